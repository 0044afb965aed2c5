// SPDX-License-Identifier: Apache-2.0
// A recording in a thread of its own, so that the page stays smooth: it answers one question a message. A
// script by itself, which the page loads when the first recording is opened.

import { damage } from "./recording/bytes.js";
import { find_losses, find_stops } from "./recording/marks.js";
import { reading } from "./recording/reading.js";

const rest_ms = 20;

let recording = null;
let busy = 0;        // questions that somebody waits for
let newest_past = 0;

const say = (what) => postMessage(what);

// Whoever searches in the background waits until nobody else does.
async function rest() {
  do await new Promise((done) => setTimeout(done, busy > 0 ? rest_ms : 0)); while (busy > 0);
  return true;
}

function facts_of({ layout, topics, begin_ms, end_ms }) {
  const { lines, indexed, ended, no_times, metadata } = layout;
  return { topics, lines, begin_ms, end_ms, indexed, ended, no_times,
    metadata: Object.fromEntries([...metadata].map(([name, values]) => [name, Object.fromEntries(values)])) };
}

// What cannot be read, in numbers.
function damage_of({ layout: { damaged }, too_long }) {
  const lines = damaged.reduce((sum, one) => sum + (one.lines ?? 0), 0);
  const cut = damaged.filter(({ why }) => why === "cut");
  const parts = damaged.filter(({ why }) => why !== "cut" && why !== "lines");
  return { lines, cut_bytes: cut.reduce((sum, { bytes }) => sum + bytes, 0), parts: parts.length, too_long,
    why: parts[0]?.why ?? null };
}

async function search_marks() {
  const tell = (stops) => say({ stops });
  tell(await find_stops(recording, tell, rest));
  say({ losses: await find_losses(recording, rest) });
}

const answers = {
  async open({ file }) {
    recording = await reading.open(file, (share) => say({ progress: share }));
    search_marks().catch(() => say({ losses: [] }));  // what is damaged is counted elsewhere
    return facts_of(recording);
  },
  look: ({ topics, at_ms }) => recording.look(topics, at_ms),
  span: ({ wanted, from_ms, to_ms }) => recording.span(wanted, from_ms, to_ms),
  // Of several that are asked for only the last one matters, and none that was dropped.
  past({ wanted, from_ms, to_ms, parts_max }) {
    const own = (newest_past += 1);
    const turn = () => new Promise((done) => setTimeout(() => done(own === newest_past), 0));
    return recording.span(wanted, from_ms, to_ms, { parts_max, goes_on: turn });
  },
  drop: () => (newest_past += 1),
  rates: ({ at_ms }) => recording.rates(at_ms),
  next: ({ at_ms }) => recording.next(at_ms),
  before: ({ at_ms }) => recording.before(at_ms),
};

async function answer({ id, what, ...question }) {
  busy += 1;
  try {
    const value = await answers[what](question);
    say({ id, value, damage: recording && damage_of(recording) });
    if (what === "span") await recording.prepare(question.to_ms);
  } catch (error) {
    const words = error instanceof damage ? error.message : `${error.name}: ${error.message}`;
    say({ id, failed: words });
  }
  busy -= 1;
}

onmessage = ({ data }) => answer(data);

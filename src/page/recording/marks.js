// SPDX-License-Identifier: Apache-2.0
// When the robot was stopped in a recording, and where messages are missing. Stops have numbers that only
// grow: between two messages that say the same, nothing happened. So they are found by halving, without
// looking into most of the file. Losses are known by the chunks that tell of them.

const stop_topic = "/rowe/stop/state";
const losses_topic = "/rowe/record/lost";
const looks_max = 600;        // into the file, for stops
const losses_looked_max = 200;
const losses_max = 2000;
const stops_max = 2000;
const words_max = 64;         // characters of a cause, and of who it was

const parsed = (text) => {
  try {
    return JSON.parse(text);
  } catch {
    return null;
  }
};

// When what it tells began: it says itself for how long it has lasted.
const began = ({ at_ms, since_ms }) => at_ms - (typeof since_ms === "number" && since_ms >= 0 ? since_ms : 0);

class stops_search {
  #recording;
  #changes = new Map();  // number and state → the first that told of it
  #times;
  looks_left = looks_max;

  constructor(recording) {
    this.#recording = recording;
    const ends = new Set(recording.parts_of(stop_topic).map(({ end_ms }) => end_ms));
    this.#times = [...ends].sort((one, other) => one - other);
  }

  // Halves until what is told is the same at both ends; the widest come first.
  async run(tell, goes_on) {
    if (this.#times.length === 0) return;
    const begin = await this.#at(-1);
    const open = [[-1, begin, this.#times.length - 1, await this.#at(this.#times.length - 1)]];
    for (let at = 0; at < open.length && this.looks_left > 0 && await goes_on(); at += 1) {
      const [low, before, high, after] = open[at];
      if (before !== null && before === after) continue;
      if (high - low < 2) {
        await this.#all_between(low, high);
        continue;
      }
      const middle = (low + high) >> 1;
      const told = await this.#at(middle);
      open.push([low, before, middle, told], [middle, told, high, after]);
      if (at % 16 === 15) tell(this.stops);
    }
  }

  // In front of all the rest is the first message, wherever its part begins.
  #time(index) { return index < 0 ? this.#recording.parts_of(stop_topic)[0].begin_ms : this.#times[index]; }

  // What is told at the end of a part.
  async #at(index) {
    this.looks_left -= 1;
    const [found] = await this.#recording.look([stop_topic], this.#time(index));
    return found ? this.#take(found) : null;
  }

  async #all_between(low, high) {
    this.looks_left -= 1;
    const wanted = [[stop_topic, 0]];
    const found = await this.#recording.span(wanted, this.#time(low), this.#time(high), { parts_max: 8 });
    for (const one of found) this.#take(one);
  }

  #take({ text, time_ms }) {
    const told = parsed(text);
    if (typeof told?.state !== "string") return null;
    const key = `${told.number} ${told.state}`;
    const known = this.#changes.get(key);
    if (!known && this.#changes.size >= stops_max) return key;
    if (!known || time_ms < known.at_ms) this.#changes.set(key, { ...told, at_ms: time_ms });
    return key;
  }

  get stops() {
    const { begin_ms: first, end_ms: last } = this.#recording;
    const told = [...this.#changes.values()].sort((one, other) => began(one) - began(other));
    return told.flatMap((one, index) => {
      if (one.state !== "stopped") return [];
      const begin_ms = Math.max(began(one), first);
      const next = told[index + 1];
      const end_ms = next ? Math.max(began(next), begin_ms) : last;
      const { number, at_ms: told_ms } = one;
      const [cause, source] = [one.cause, one.source].map((each) => String(each ?? "").slice(0, words_max));
      return [{ begin_ms, told_ms, end_ms, number, cause, source }];
    });
  }
}

// [{begin_ms, told_ms, end_ms, number, cause, source}] of each stop, by its time; `tell(stops)` now and then,
// goes_on() may wait.
export async function find_stops(recording, tell = () => {}, goes_on = () => true) {
  const search = new stops_search(recording);
  await search.run(tell, goes_on);
  return search.stops;
}

// [{at_ms, topic, messages}] of each loss; what it says of those in many chunks is not looked for.
export async function find_losses(recording, goes_on = () => true) {
  const all = recording.parts_of(losses_topic);
  const known = all.some(({ channels }) => channels);
  const others = known ? all.slice(losses_looked_max, losses_max) : [];
  const found = others.map(({ begin_ms }) => ({ at_ms: begin_ms, messages: null }));
  for (const part of all.slice(0, losses_looked_max)) {
    if (!await goes_on()) break;
    const wanted = [[losses_topic, 0]];
    const told = await recording.span(wanted, part.begin_ms - 0.001, part.end_ms, { parts_max: 8, goes_on });
    for (const { time_ms, text } of told ?? []) {
      if (found.length >= losses_max) break;
      const { topic, messages } = parsed(text) ?? {};
      if (typeof messages === "number") found.push({ at_ms: time_ms, topic: String(topic), messages });
    }
  }
  const seen = new Map(found.map((one) => [`${one.at_ms} ${one.topic}`, one]));
  return [...seen.values()].sort((one, other) => one.at_ms - other.at_ms);
}

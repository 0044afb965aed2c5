// SPDX-License-Identifier: Apache-2.0
// The words of the deck, and how it writes times.

import { causes } from "../text.js";
import { count, duration } from "../numbers.js";

const two = (number) => String(number).padStart(2, "0");

// A time of the recording since its begin: "0:02.2", "1:02:03.4".
export function since_begin(ms) {
  const tenths = Math.max(0, Math.floor(ms / 100));
  const seconds = Math.floor(tenths / 10);
  const [h, min, s] = [Math.floor(seconds / 3600), Math.floor(seconds / 60) % 60, seconds % 60];
  return `${h > 0 ? `${h}:${two(min)}` : min}:${two(s)}.${tenths % 10}`;
}

const some = (number, one, many) => `${count(number)} ${number === 1 ? one : many}`;
const size = (bytes) => (bytes < 1e4 ? some(bytes, "byte", "bytes")
  : bytes < 1e6 ? `${count(bytes / 1e3)} kB` : `${(bytes / 1e6).toFixed(1)} MB`);

export const words = {
  deck: "Recording", play: "Play", pause: "Pause", back: "Back to the robot", cancel: "Cancel",
  step: "To the next message", step_back: "To the message before",
  speed: "Speed", times: (speed) => `${speed}\u00d7`,
  seek: "Time of the recording",
  position: (at, all) => `${at} / ${all}`,
  position_spoken: (ms, all) => `${duration(ms / 1000)} of ${duration(all / 1000)}`,
  next_mark: "Next mark",
  reading: (share) => `Reading the file: ${Math.floor(share * 100)} %`,
  marks: (stops, messages, places) => [
    stops > 0 ? some(stops, "stop", "stops") : "",
    messages > 0 ? `${some(messages, "message", "messages")} lost` : places > 0 ? "messages lost" : "",
  ].filter(Boolean).join(", "),
  searching: "Looking for stops\u2026",
  stopped: ({ cause, source }) =>
    `Stopped then: ${Object.hasOwn(causes, cause) ? causes[cause](source) : String(cause)}`,
  cannot_show: ({ encoding }) => `Encoding ${encoding || "not known"}: cannot be shown here`,
  no_end: "Its program did not come to its end",
  no_index: "It has no list of its parts, so it was looked through",
  no_times: "It has no times: ten messages a second are taken",
  damaged: (parts, why) => `${some(parts, "part", "parts")} cannot be read (${why})`,
  cut: (bytes) => `the last ${size(bytes)} cannot be read`,
  lines: (lines) => `${some(lines, "line is no message", "lines are no messages")}`,
  too_long: (messages) => `${some(messages, "message is", "messages are")} too long to be shown`,
  unreadable: (messages) => `${some(messages, "message is", "messages are")} not JSON`,
};

// What is missing, in sentences; empty: nothing.
export function missing({ lines: is_lines, indexed, ended, no_times }, damage, unreadable) {
  const { parts = 0, why, cut_bytes = 0, lines = 0, too_long = 0 } = damage ?? {};
  const said = [
    !ended ? words.no_end : !indexed && !is_lines ? words.no_index : "",
    cut_bytes > 0 ? words.cut(cut_bytes) : "", parts > 0 ? words.damaged(parts, why) : "",
    lines > 0 ? words.lines(lines) : "", no_times ? words.no_times : "",
    unreadable > 0 ? words.unreadable(unreadable) : "", too_long > 0 ? words.too_long(too_long) : "",
  ].filter(Boolean).join("; ");
  return said && said[0].toUpperCase() + said.slice(1);
}

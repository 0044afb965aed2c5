// SPDX-License-Identifier: Apache-2.0
// Every word the page shows, and how it writes numbers. Nothing else in this folder holds text meant for
// people, but for the sentence in index.html that is shown where scripts are off.

const minus = "\u2212";
export const absent = "\u2013";

// `value` with `digits` decimals and a minus sign as wide as a digit; a dash for what is not a number.
export function fixed(value, digits) {
  if (!Number.isFinite(value)) return absent;
  const shown = Math.abs(value).toFixed(digits);
  return value < 0 && Number(shown) !== 0 ? minus + shown : shown;
}

// A length in metres, within seven characters up to 10 000 km.
export function metres(value) {
  const size = Math.abs(value);
  return fixed(value, size < 100 ? 3 : size < 1000 ? 2 : size < 10000 ? 1 : 0);
}

// A count with thin spaces between its thousands.
export function count(value) {
  if (!Number.isFinite(value)) return absent;
  return String(Math.round(value)).replace(/\B(?=(\d{3})+$)/g, "\u202f");
}

// Something per second: one decimal below 10 000, thousands parted above; a plain 0 for none.
export function rate(value) {
  if (!Number.isFinite(value)) return absent;
  if (value >= 9999.95) return count(value);
  return value > 0 ? fixed(value, 1) : "0";
}

// How old something is: "18 ms", "2.4 s", "3 min".
export function age(ms) {
  if (ms < 1000) return `${Math.round(ms)} ms`;
  if (ms < 99950) return `${(ms / 1000).toFixed(1)} s`;
  return duration(ms / 1000);
}

// How long something has lasted: "12 s", "3 min 5 s", "4 h 10 min", "3 d 4 h".
export function duration(seconds) {
  if (!Number.isFinite(seconds)) return absent;
  const units = [["d", 86400], ["h", 3600], ["min", 60], ["s", 1]];
  let rest = Math.floor(seconds);
  const parts = [];
  for (const [unit, size] of units) {
    const whole = Math.floor(rest / size);
    rest -= whole * size;
    if (whole > 0 || parts.length > 0) parts.push(`${whole} ${unit}`);
    if (parts.length === 2) break;
  }
  return parts.join(" ") || "0 s";
}

// Seconds to come: tenths below one, and never none.
const until = (ms) => Math.max(0.1, ms / 1000).toFixed(ms < 950 ? 1 : 0);

// What is shown of a connection's state: a mark that differs in shape, a word, and the sentence in the bar.
export const states = {
  connecting: { mark: "\u25cb", word: "connecting", sentence: () => "connecting\u2026" },
  disconnected: {
    mark: "\u25cb",
    word: "disconnected",
    sentence: ({ retry_in_ms: ms }) =>
      ms > 0 ? `disconnected, retrying in ${until(ms)} s` : "disconnected, trying now",
  },
  waiting: { mark: "\u25cc", word: "waiting", sentence: (link) => `connected, waiting for ${link.topic}` },
  stale: { mark: "\u25b2", word: "STALE", sentence: (link) => `STALE ${age(link.age_ms)}` },
  live: { mark: "\u25cf", word: "live", sentence: (link) => `live, ${age(link.age_ms)} old` },
};

export const text = {
  path_label: "The path driven, seen from above. The numbers beside it say where it ends.",
  topic_label: "topic shown",
  numbers: "Last pose",
  x: "x", y: "y", z: "z", heading: "heading", speed: "v", turn: "\u03c9",
  metres: "m", degrees: "\u00b0", metres_per_second: "m/s", radians_per_second: "rad/s",
  rates: "Rates",
  topic: "topic", rate: "Hz", gap: "gap, ms", bytes: "bytes", subscribers: "readers", messages: "messages",
  untyped: "untyped",
  losses: "Losses",
  loss: "what was lost", since_start: "total", per_second: "per s",
  thinned: "thinned on purpose",
  stale: "STALE",

  follow: "follow",
  bar_metres: (length) => `${length} m`,
  title: (mark, name, word) => `${mark} ${name} ${word}`,
  uptime: (seconds, peers) =>
    [
      Number.isFinite(seconds) ? `up ${duration(seconds)}` : "",
      Number.isFinite(peers) ? `${peers} ${peers === 1 ? "peer" : "peers"}` : "",
    ].filter(Boolean).join(" \u00b7 "),
  real_time: ({ fifo, pinned, locked }) =>
    [
      fifo ? "real-time priority" : "no real-time priority",
      pinned ? "pinned to a core" : "not pinned",
      locked ? "memory locked" : "memory not locked",
    ].join(", "),
  says: (message) => `The endpoint says: ${message}`,
  axes: "x \u2192  y \u2191",
  silent_topic: (topic) => `${topic} is silent, the endpoint still answers`,
  silent: "nothing arrives from the endpoint any more",
  known: "shown is what was known last",
};

// The counters of /rowe/stats in plain words, in the order in which they are shown.
export const losses = {
  full: "refused, queue full",
  expired: "too old to be sent",
  outbox_full: "dropped, slow peer",
  no_slot: "no slot free",
  inbox_full: "dropped, slow subscriber",
  lost_with_peer: "gone with its peer",
  lost_at_close: "left when it closed",
  too_big: "larger than its slot",
  malformed: "not a JSON object",
  undecodable: "not what the handle reads",
  inbound_expired: "too old to be taken",
  calls_timed_out: "calls not answered in time",
  calls_lost: "calls whose provider left",
  replies_late: "replies that came late",
  replies_foreign: "replies to no call",
  replies_unsent: "answers to nobody left",
  stop_answers_lost: "answers to a stop",
};

// Counters of messages that somebody chose not to have.
export const thinned = {
  no_peer: "nobody listening",
  throttled: "slower rate asked for",
  replaced: "newer value replaced it",
};

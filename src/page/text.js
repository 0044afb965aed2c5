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

// How long something short took: "0.34 ms", "4.2 ms", "120 ms", "1.2 s".
export function short(ms) {
  return ms < 99.95 ? `${ms.toFixed(ms < 0.995 ? 2 : 1)}\u00a0ms` : age(ms);
}

// An address without its port, which changes with each connection; anything else as it is.
const address = (source) => String(source).replace(/^(\d+(?:\.\d+){3}|\[[^\]]*\]):\d+$/, "$1");

// The calendar's time of day: "07:39:05".
export const clock = (at) => new Date(at).toTimeString().slice(0, 8);

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

// The same of the robot's stop; `source` is who stopped it, `name` that of a guard or a loop.
export const latch = {
  running: { mark: "\u25b6", word: "running" },
  stopped: { mark: "\u25a0", word: "STOPPED" },
  unknown: { mark: "?", word: "unknown" },
};

// Why the robot stopped, by what the robot calls it.
export const causes = {
  start: () => "it starts stopped, a reset lets it move",
  request: () => "it was asked to stop",
  guard: (name) => `its guard ${name} fell silent or went away`,
  loop: (name) => `its loop ${name} was late or ended`,
  service: (name) => `its loop ${name} found the service thread silent`,
};

// Behind a right that is missing: the robot does not say whether it has roles.
const own_machine = " (a robot without roles: only from its own machine)";

// What the robot did not do, and why.
export const refusals = {
  reset_number: "not reset: it was stopped once more meanwhile",
  reset_tick: "not reset: too late, or stopped again meanwhile; try again",
  reset_role: "not reset: your role has no right to reset" + own_machine,
  reset_guards: "not reset: a guard is missing",
  reset_loops: "not reset: a loop has not acknowledged the stop, or does not run",
  guard_role: "not guarding: your role has no right to guard" + own_machine,
  dismiss_role: "not removed: that needs the right to reset, which your role does not have" + own_machine,
  guard_service: "not guarding: the robot refuses this page as a guard; load the page again",
  guard_guards: "not guarding: it has as many guards as it can have",
  guard_name: "not guarding: another guard has this name",
  guard_tick: "not guarding: the request was too late, try again",
};

export const text = {
  stop: "STOP",
  stop_label: "Stop",
  permit_label: "Guard and reset",
  stop_print: "a software stop, not a safety-rated emergency stop",
  no_stop: "no stop configured",
  stopped_by: (source) => `STOPPED by ${address(source)}`,
  stopped_at: (time) => ` at ${time}`,
  stopping: "stopping\u2026",
  acknowledged: (name, { took_ms, own_ms }) =>
    `acknowledged in ${short(took_ms)} by ${name} ` +
    (own_ms < 0 ? "(it had stopped before)" : `(its own time ${short(own_ms)})`),
  not_acknowledged: (ms) => `NOT ACKNOWLEDGED for ${duration(ms / 1000)}, asking again and again`,
  not_observed: (ms, loops) =>
    `NOT ACKNOWLEDGED for ${duration(ms / 1000)} by its loop ${loops}, asking again and again`,
  not_sent: "NOT ACKNOWLEDGED: not connected; the page asks again when it is",
  stop_unreachable: "not connected: this button cannot reach the robot",
  only_stop: "no connection is free: only STOP works",
  stop_asking: "asking whether the robot has a stop",
  stop_silent: "the robot no longer reports its stop",
  moves_unguarded: "UNGUARDED: it may move although nobody guards it",
  moves_guarded: "it stops when a guard falls silent",
  guard: "Guard this robot",
  guarding: "Guarding: end it",
  guards_none: "no guard: it cannot move",
  guards_unguarded: "UNGUARDED: it moves without a guard",
  guards: (names) => `guarded by ${names.join(", ")}`,
  guard_this: (name) => `${name} (this page)`,
  guard_silent: (name) => `${name} (silent)`,
  guard_hidden: "this page was hidden, so it no longer guards",
  dismiss: (name) => `remove ${name}`,
  reset: "Hold 2 s to reset",
  reset_hold: "keep holding",

  token_label: "Token",
  token_wanted: "This robot wants to know who you are: open the link of its set-up, or type a token.",
  token_unknown: "This robot does not know this token, or no longer knows it. Type another one.",
  token_send: "Connect",

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
  silent: "the endpoint no longer sends anything",
  known: "the page shows the last known values",
};

// The counters of /rowe/stats in plain words, in the order in which they are shown.
export const losses = {
  full: "refused, queue full",
  expired: "too old to be sent",
  outbox_full: "dropped, slow peer",
  evicted: "dropped to make room",
  no_slot: "no slot free",
  no_chunks: "no room, long message",
  fragments_lost: "fragments without the rest",
  not_latched: "not kept for late ones",
  inbox_full: "dropped, slow subscriber",
  lost_with_peer: "gone with its peer",
  left_behind: "asked by a peer that had gone",
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
  throttled: "slower rate asked for",
  replaced: "newer value replaced it",
};

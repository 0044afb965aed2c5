// SPDX-License-Identifier: Apache-2.0
// Every word the page shows. Nothing else in this folder holds text meant for people, but for the sentence in
// index.html that is shown where scripts are off, and recording/words.js, which is loaded with a recording.

import { address, age, duration, fixed, short, until } from "./numbers.js";

// What is shown of a connection's state: a drawing that differs in shape, a sign for the title, a word, and
// what is said beside and below it. `age` is that of what is shown; it says nothing of what never came.
const disconnected = ({ retry_in_ms: ms }) => (ms > 0 ? `trying again in ${until(ms)} s` : "trying now");
const heard = ({ heard_at }) => (heard_at ? `Last heard ${heard_at}, ` : "Not heard yet, ");
export const states = {
  connecting: { draws: "away", sign: "\u25cb", word: "Connecting", about: () => "Connecting\u2026" },
  disconnected: {
    draws: "away", sign: "\u25cb", word: "DISCONNECTED",
    about: (link) => heard(link) + disconnected(link),
    veil: ({ heard_at }) => (heard_at ? `As it was at ${heard_at}` : "Disconnected"),
  },
  waiting: {
    draws: "waiting", sign: "\u25cc", word: "Waiting",
    about: ({ topic }) => `Connected, waiting for ${topic}`,
  },
  stale: {
    draws: "stale", sign: "\u25b2", word: "STALE",
    about: ({ topic, heard_at, answers }) =>
      answers ? `The link is open, ${topic} is silent since ${heard_at}`
        : `The robot says nothing since ${heard_at}`,
    veil: ({ age_ms }) => `Data is ${age(age_ms)} old`,
  },
  live: { draws: "live", sign: "\u25cf", word: "Live", about: () => "" },
  recording: {
    draws: "open", sign: "\u25b7", word: "RECORDING",
    about: ({ recorded }) => recorded, veil: ({ stopped }) => stopped,
  },
};

// The same of the robot's stop.
export const latch = {
  running: { draws: "running", word: "Running", sign: "\u25b6" },
  stopped: { draws: "stopped", word: "Stopped", sign: "\u25a0" },
  stopping: { draws: "stopped", word: "Stopping\u2026", sign: "\u25a0" },
  unknown: { draws: "unknown", word: "Unknown", sign: "?" },
};

// Why the robot stopped, by what the robot calls it; `name` is that of who stopped it, a guard or a loop.
export const causes = {
  start: () => "It starts stopped, a reset lets it move",
  request: (name) => `by ${address(name)}`,
  guard: (name) => `Its guard ${name} fell silent or went away`,
  loop: (name) => `Its loop ${name} was late or ended`,
  service: (name) => `Its loop ${name} found the service thread silent`,
};

// Behind a right that is missing: the robot does not say whether it has roles.
const own_machine = " (a robot without roles: only from its own machine)";

// What the robot did not do, and why.
export const refusals = {
  reset_number: "Not reset: it was stopped once more meanwhile",
  reset_tick: "Not reset: too late, or stopped again meanwhile; try again",
  reset_role: "Not reset: your role has no right to reset" + own_machine,
  reset_guards: "Not reset: a guard is missing",
  reset_loops: "Not reset: a loop has not acknowledged the stop, or does not run",
  reset_lost: "Not known whether it was reset: no answer came",
  guard_role: "Not guarding: your role has no right to guard" + own_machine,
  dismiss_role: "Not removed: that needs the right to reset, which your role does not have" + own_machine,
  guard_guards: "Not guarding: it has as many guards as it can have",
  guard_name: "Not guarding: another guard has this name",
  guard_tick: "Not guarding: the request was too late, try again",
  guard_lost: "Not guarding: no answer came, or this robot refuses this page as a guard",
};

// The same of control of a driven topic; `right` is the one that is missing.
export const control_refusals = {
  topic: () => "This robot is not driven by this topic any more",
  action: () => "This robot does not know what was asked for",
  tick: () => "Not taken: the request was too late, try again",
  role: ({ right }) => `Your role may not ${right === "take_over" ? "take over from others" : "drive"}`,
  driven: ({ driver }) => `Not taken: ${driver ? address(driver) : "somebody else"} was quicker`,
  pause: () => "Not taken: it changed hands less than a second ago",
  lost: () => "Not taken: no answer came",
};

// Why this page does not drive any more.
export const losses_of_control = {
  taken_over: ({ driver }) => `${driver ? address(driver) : "Somebody else"} took over`,
  expired: () => "Control ended: nothing was heard of this page for too long",
  refused: () => "The robot does not let this page drive any more",
  closed: () => "The connection was lost, and control with it",
};

export const text = {
  stop: "STOP", stopped: "STOPPED", stopping: "STOPPING", not_sent: "NOT SENT",
  stop_label: "Stop",
  stop_print: "Software stop, not safety-rated",
  stop_keys: "Space or Esc \u00b7 not safety-rated",
  stop_again: "Press to stop once more",
  stop_asks: "Asked again until it answers",
  stop_waits: "It goes out once connected",
  stop_unreachable: "Cannot reach the robot. Use its wired stop",
  no_stop: "No stop configured",
  stopped_at: (time, why) => `${time} \u00b7 ${why}`,
  asked: (ms) => `Asked ${age(ms)} ago`,
  acknowledged: ({ took_ms, own_ms }) =>
    own_ms < 0 ? `${short(took_ms)}: it had stopped before`
      : `${short(took_ms)}: robot ${short(own_ms)}, network ${short(Math.max(0, took_ms - own_ms))}`,
  acknowledged_short: ({ took_ms, own_ms }) =>
    own_ms < 0 ? short(took_ms) : `${short(took_ms)}, robot ${short(own_ms)}`,
  not_acknowledged: (ms) => `NOT ACKNOWLEDGED for ${duration(ms / 1000)}, asking again and again`,
  not_observed: (ms, loops) =>
    `NOT ACKNOWLEDGED for ${duration(ms / 1000)} by its loop ${loops}, asking again and again`,
  press_waits: "A press is sent once connected",
  press_goes: "STOP is sent at once, and again",
  only_stop: "No connection is free: only STOP works",
  stop_asking: "Asking whether the robot has a stop",
  last_heard: (state, time) => `${latch[state].word} when last heard, ${time}`,
  never_heard: "Nothing was heard of its stop",
  unguarded: "UNGUARDED", guarded_here: "Guarded by you",
  guarded: (names) => `Guarded by ${names.join(", ")}`,
  moves_unguarded: "It moves without a guard",
  moves_guarded: "It stops when its guard is silent",
  who_resets: "A supervisor resets it",
  guard: "Guard this robot",
  guarding: "End guarding",
  guards_none: "No guard: it cannot move",
  guard_silent: (name) => `Its guard ${name} is silent`,
  guard_hidden: "This page was hidden, so it no longer guards",
  dismiss: (name) => `Remove ${name}`,
  reset: "Hold 2 s to reset",
  reset_hold: (s) => `Keep holding, ${s} s`,

  drive_label: "Drive", driven_label: "Topic that is driven",
  you_drive: "You drive",
  drives: (name) => `Driven by ${address(name)}`,
  nobody_drives: "Nobody drives",
  standstill: "Standstill. Hold to drive",
  commands: (speed, turn) => `${fixed(speed, 2)} m/s, ${fixed(turn, 2)} rad/s`,
  changes_hands: "It stands still before it changes hands",
  take: "Take the controls",
  take_over: (name) => `Take over from ${address(name)}`,
  release: "Let go",
  no_driving: { stale: "No driving while the data is old", stopped: "Stopped: the stick moves nothing",
    stopping: "Stopping: the stick moves nothing", unknown: "No driving while its stop is not known",
    disconnected: "No driving without a connection", connecting: "No driving without a connection",
    recording: "No driving while a recording is shown" },
  let_go_first: "Let go, then drive again",
  stick_label: "Stick. Hold the arrow keys or W A S D to drive; the robot stands still when you let go.",
  limit: "Speed limit", limit_value: (value) => `${fixed(value, 2)} m/s`,
  keys: "W A S D or arrows while held",
  pads: (count) => (count ? "gamepad: left stick" : "no gamepad"),
  pad_frozen: "The gamepad does not answer: let go",

  token_label: "Token",
  token_wanted: "This robot wants to know who you are: open the link of its set-up, or type a token.",
  token_unknown: "This robot does not know this token, or no longer knows it. Type another one.",
  token_send: "Connect",

  views: "Views", overview: "Overview", drive: "Drive", plots: "Plot", data: "Data",
  plot: "Plot", plot_value: (path) => `Plot ${path}`, plot_of: (name) => `${name} over time`,
  plot_none: "Nothing is plotted. Open a topic in Data, and press Plot beside a number.",
  pause: "Pause", span_label: "Time shown", span: (s) => (s < 60 ? `${s} s` : `${s / 60} min`),
  remove: "Remove", remove_plot: (name) => `Remove the plot of ${name}`,
  plot_licence: "Plots are drawn by dygraphs",
  main_label: "What the robot says",
  map_tools: "Map",
  path_label: "The path driven, seen from above. The numbers beside it say where it ends.",
  topic_label: "Topic shown",
  image_label: "What the camera sees", camera_label: "Camera shown", swap: "Camera in front of the map",
  no_image: "This is not an image that the page shows", no_new_image: "No new image",
  follow: "Follow the robot", zoom_in: "Zoom in", zoom_out: "Zoom out",
  numbers: "Last pose",
  x: "x", y: "y", z: "z", heading: "heading", speed: "speed", turn: "turn",
  metres: "m", degrees: "\u00b0", metres_per_second: "m/s", radians_per_second: "rad/s",
  topics: "Topics", find: "Find", find_topic: "Find a topic by its name or type",
  some_of: (shown, all) => `${shown} of ${all}`,
  topic: "name and type", rate: "Hz", gap: "gap, ms",
  untyped: "untyped",
  items: (length) => `${length} items`,
  show_items: "Show", show_items_of: (path) => `Show the items of ${path}`,
  leaves: (shown) => ` \u00b7 its first ${shown} values`,
  copy: "Copy", copy_of: (topic) => `Copy the last message of ${topic}`, copied: "Copied",
  nothing_yet: "Nothing has come yet",
  plots_full: " \u00b7 four plots at most: remove one first",
  topic_about: (bytes, readers) => `${bytes} bytes \u00b7 ${readers} ${readers === 1 ? "reader" : "readers"}`,
  parameters: "Parameters", set: "Set", is_set: "Set",
  services: "Services", call: "Call", call_of: (name) => `Call ${name}`, calling: "Calling\u2026",
  request: "request, JSON",
  no_json: (name) => `${name}: this is not JSON`,
  no_number: (name) => `${name}: this is not a number`,
  no_integer: (name) => `${name}: this is not a whole number`,
  too_large: (name) => `${name}: a browser is exact up to ${Number.MAX_SAFE_INTEGER} only`,
  from_to: (least, most) => `${least} to ${most}`,
  from: (least) => `${least} or more`, up_to: (most) => `up to ${most}`,
  black_box: "Black box", keep: "Keep what led here",
  keep_about: "Writes the last seconds, and what comes for some more, into a file on the robot.",
  kept: "It writes", not_kept: "It has no room now; try again", kept_by_page: "asked on the page",
  losses: "Losses",
  no_losses: (counters) => `None since start; all of ${counters} counters are zero`,
  some_losses: (counters) =>
    (counters === 1 ? "One counter is not zero" : `${counters} counters are not zero`),
  loss: "what was lost", since_start: "total", per_second: "per s",
  thinned: "Thinned on purpose, which is no loss",
  loops: "Loops", loop: "cycle, ms", half: "p50", p99: "p99", p999: "p99.9", longest: "max", bound: "bound",
  cycle: (us) => `service thread: longest cycle ${us} \u00b5s`,
  real_time: ({ fifo, pinned, locked }) =>
    [
      fifo ? "real-time priority" : "no real-time priority",
      pinned ? "pinned to a core" : "not pinned",
      locked ? "memory locked" : "memory not locked",
    ].join(", "),
  peers: "Peers", slowest: "slowest first", waiting: "waiting", silent: "silent for",
  blocked: (queued) => `${queued}, blocked`,
  bar_metres: (length) => `${length} m`,
  axes: "x \u2192  y \u2191",

  open_recording: "Open a recording", drop_here: "Drop a recording to look into it",
  not_opened: (name, why) => `${name} cannot be opened: ${why}`,
  not_loaded: "the robot does not answer",
  robot_now: (word) => `Robot now: ${word}`,
  recorded_at: (day, time, robot) => [`Recorded ${day} ${time}`, robot].filter(Boolean).join(" \u00b7 "),
  recorded_about: (bytes, messages) =>
    `${bytes} bytes` + (messages === null ? "" : ` \u00b7 ${messages} recorded`),

  title: (sign, name, word) => `${sign} ${name} ${word}`,
  spoken: (name, word) => `${name} ${word}`,
  age: (ms) => `${age(ms)} old`,
  age_of_old: (ms) => age(ms),
  robot_clock: (time) => `Robot clock ${time}`,
  uptime: (seconds, peers) =>
    [
      Number.isFinite(seconds) ? `up ${duration(seconds)}` : "",
      Number.isFinite(peers) ? `${peers} ${peers === 1 ? "peer" : "peers"}` : "",
    ].filter(Boolean).join(" \u00b7 "),
  says: (message) => `The endpoint says: ${message}`,
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

// The same of commands to drive that nothing obeyed; only the answer of the service /rowe/stats has them.
export const commands = {
  commands_refused: "commands, another one drives",
  commands_unproven: "commands of unknown age",
  commands_stale: "commands, too old",
  commands_stopped: "commands while stopped",
};

// Counters of messages that somebody chose not to have.
export const thinned = {
  throttled: "slower rate asked for",
  replaced: "newer value replaced it",
};

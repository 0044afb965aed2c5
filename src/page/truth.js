// SPDX-License-Identifier: Apache-2.0
// Whether what one sees is true now, and what the robot's clock shows.
//
// Whether the robot is alive is judged by the age of its last pose, never by the socket: a loop that died
// behind an endpoint that still answers must not look alive.

import { moment, since_ms } from "../../clients/js/src/link.js";

const stale_ms_min = 500;
const stale_ms_max = 5000;
const gaps_max = 5;
const ask_clock_ms = 60000;

// How old a value may be before it is stale: three times as old as it usually gets. Asked for `hz` times a
// second at most, it may come less often.
export class usual_age {
  #gaps = [];

  came(gap_ms) {
    if (Number.isFinite(gap_ms)) this.#gaps = [...this.#gaps, gap_ms].slice(-gaps_max);
  }

  // `told_hz`: how often the robot says that it comes; holds until gaps are known.
  stale_ms(hz, told_hz) {
    const sorted = [...this.#gaps].sort((one, other) => one - other);
    const usual = sorted[Math.floor((sorted.length - 1) / 2)] ?? (told_hz > 0 ? 1000 / told_hz : 0);
    return Math.min(stale_ms_max, Math.max(stale_ms_min, 3 * Math.max(usual, 1000 / hz)));
  }
}

// connecting, disconnected, waiting (for the first pose), stale or live. `link` is the client's state, `pose`
// the feed of poses, and `stale_ms` how old one may be; `heard`: one came before, on this feed or before it
// was asked for anew.
export function judge(link, pose, stale_ms, heard) {
  if (link === "connecting") return "connecting";
  if (link !== "open") return "disconnected";
  if (pose.age_ms === Infinity) return heard && pose.asked_ms > stale_ms ? "stale" : "waiting";
  return pose.fresh(stale_ms) ? "live" : "stale";
}

// The robot's clock, which is not that of this machine: asked for now and then, and believed as of the middle
// of the question.
export class robot_clock {
  #robot;
  #asked = null;
  ahead_ms = null;  // of the clock here; null: not known

  constructor(robot) {
    this.#robot = robot;
    robot.on("open", () => (this.#asked = null));
  }

  // The robot's time for a time here.
  at(here_ms) { return here_ms + (this.ahead_ms ?? 0); }

  turn() {
    if (this.#robot.state !== "open" || (this.#asked && since_ms(this.#asked) < ask_clock_ms)) return;
    this.#asked = moment();
    const { calendar } = this.#asked;
    this.#robot.call("/rosapi/get_time").then(({ time }) => {
      const robot_ms = (time?.secs ?? time?.sec) * 1000 + (time?.nsecs ?? time?.nanosec) / 1e6;
      if (Number.isFinite(robot_ms)) this.ahead_ms = robot_ms - (calendar + Date.now()) / 2;
    }, () => {});  // a role may not ask: then no clock is shown
  }
}

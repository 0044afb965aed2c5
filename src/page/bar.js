// SPDX-License-Identifier: Apache-2.0
// The bar: who this is, and whether it is true now. When it is not, the whole bar changes, not a sign in it.

import { draw, element, mark, write } from "./dom.js";
import { clock } from "./numbers.js";
import { states, text } from "./text.js";

const age_ms_step = 300;  // the age of what is live is written anew only so often: it must be readable

export class bar {
  #written_at = 0;
  #state = null;

  // `state` of truth.js; `seen`: {topic, age_ms, heard_at, retry_in_ms, answers, name, clock_ms, uptime,
  // driver}; `stopped`: what is more than the link, or null.
  show(state, seen, stopped) {
    const { draws, sign, word, about, veil } = states[state];
    const changed = state !== this.#state;
    this.#state = state;
    const now = performance.now();
    if (changed || state !== "live" || now - this.#written_at >= age_ms_step) {
      this.#written_at = now;
      const known = Number.isFinite(seen.age_ms);
      const words = state === "live" ? text.age : text.age_of_old;
      write(element("age"), known ? words(seen.age_ms) : "");
    }
    write(element("name"), seen.name);
    write(element("about"), about(seen) || seen.driver || (seen.clock_ms === null ? seen.uptime
      : text.robot_clock(clock(seen.clock_ms))));
    element("about").title = seen.uptime;
    write(element("veil"), veil?.(seen) ?? "");
    const shown = stopped ?? { sign, word };
    write(document.querySelector("title"), text.title(shown.sign, seen.name, shown.word));
    if (!changed) return false;
    draw(element("mark"), draws);
    write(element("state"), word);
    mark(document.body, "data-state", state);
    write(element("spoken"), text.spoken(seen.name, word));
    return true;
  }
}

// SPDX-License-Identifier: Apache-2.0
// How the endpoint does: losses in one line while all are zero, its loops and service thread, and its peers,
// slow ones first.

import { children_of, element, make, write } from "./dom.js";
import { rate_meter } from "./meters.js";
import { address, age, count, period_ms, rate } from "./numbers.js";
import { commands, losses, text, thinned } from "./text.js";

const names_max = 32;  // counters shown: no message can grow the page without end
const peers_max = 64;

const row_of = (cells) => () => {
  const row = make("tr", {}, make("th", { scope: "row" }));
  for (let cell = 1; cell < cells; cell += 1) row.append(make("td"));
  return row;
};

// The counters of one kind, those that are not zero.
class counters {
  #meters = new Map();
  #body;
  #labels;

  constructor(body, labels) {
    this.#body = body;
    this.#labels = labels;
  }

  show(all, at, strangers = []) {
    const names = [...Object.keys(this.#labels), ...strangers];
    const some = names.filter((name) => all[name] > 0).slice(0, names_max);
    for (const name of this.#meters.keys()) if (!some.includes(name)) this.#meters.delete(name);
    const rows = children_of(this.#body, some, row_of(3));
    some.forEach((name, index) => {
      if (!this.#meters.has(name)) this.#meters.set(name, new rate_meter());
      const per_second = this.#meters.get(name).rate(at, all[name]);
      const [label, total, each] = rows[index].children;
      write(label, this.#labels[name] ?? name.replaceAll("_", " "));
      write(total, count(all[name]));
      write(each, rate(per_second));
      rows[index].toggleAttribute("data-some", per_second > 0);
    });
    return some.length;
  }
}

export class health_view {
  #lost = new counters(element("losses"), { ...losses, ...commands });
  #commands = {};  // those of `commands`
  #thinned = new counters(element("thinned"), thinned);

  // `at` is the endpoint's time in seconds.
  show(stats, at) {
    const all = { ...stats.losses, ...this.#commands };
    const names = Object.keys(all).filter((name) => !(name in thinned));
    const known = { ...losses, ...commands };
    const some = this.#lost.show(all, at, names.filter((name) => !(name in known)));
    this.#thinned.show(all, at);
    write(element("losses_say"), some === 0 ? text.no_losses(names.length) : text.some_losses(some));
    element("losses_table").hidden = some === 0;
    this.#show_loops(stats.loops);
    const { real_time, cycle_us_max } = stats;
    const own = real_time?.text;  // the endpoint's own words come first
    const words = typeof own === "string" ? own : real_time && text.real_time(real_time);
    write(element("service_thread"), [
      Number.isFinite(cycle_us_max) ? text.cycle(count(cycle_us_max)) : "", words ?? "",
    ].filter(Boolean).join(" \u00b7 "));
  }

  // How regularly each loop runs, `loops` as in /rowe/stats.
  #show_loops(loops) {
    const listed = (Array.isArray(loops) ? loops : []).slice(0, names_max);
    const rows = children_of(element("loops"), listed.map(({ name }, at) => `${at} ${name}`), row_of(6));
    listed.forEach((one, index) => {
      const [label, ...cells] = rows[index].children;
      write(label, String(one.name));
      const shown = [one.p50_us, one.p99_us, one.p999_us, one.max_us, one.bound_us];
      shown.forEach((us, at) => write(cells[at], period_ms(us)));
    });
    element("loops_table").hidden = listed.length === 0;
  }

  // `answer` as of the service /rowe/stats.
  show_answer({ connections, connections_left_out: left_out = 0, counters: counted = {} }) {
    this.#commands = Object.fromEntries(
      Object.keys(commands).filter((name) => name in counted).map((name) => [name, counted[name]]));
    if (!Array.isArray(connections)) return;
    const slow = (one) => (one.blocked ? 1e9 : 0) + one.queued;
    const listed = [...connections].sort((one, other) => slow(other) - slow(one)).slice(0, peers_max);
    write(element("peers_count"), count(connections.length + left_out));
    const rows = children_of(element("peers"), listed.map((one) => one.address), row_of(3));
    listed.forEach((one, index) => {
      const [label, waiting, silent] = rows[index].children;
      if (!label.firstChild) label.append(make("span"), make("small"));
      write(label.firstChild, one.name ?? address(one.address));
      write(label.lastChild, [one["dialect"], one.role].filter(Boolean).join(" \u00b7 "));
      write(waiting, one.blocked ? text.blocked(count(one.queued)) : count(one.queued));
      write(silent, age(one.silent_s * 1000));
      rows[index].toggleAttribute("data-some", one.blocked || one.queued > 0);
    });
  }
}

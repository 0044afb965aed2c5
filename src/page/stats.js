// SPDX-License-Identifier: Apache-2.0
// The two tables filled from /rowe/stats: what runs at which rate, and what was lost. Whatever the endpoint
// does not say is shown as a dash.

import { children_of, make, write } from "./dom.js";
import { count, fixed, rate } from "./numbers.js";
import { losses, text, thinned } from "./text.js";

const names_max = 32;      // counters and topics shown: no message can grow the page without end
const window_seconds = 2;  // over which a count becomes a rate, and a peak is held: long enough to be read
const samples_max = 64;

// Turns a count that only grows into a rate over the last `window_seconds`. Memory is fixed.
export class rate_meter {
  constructor() {
    this.samples = [];
  }

  // `at` in seconds. Returns the rate, or NaN until two samples are there. A count that fell was started
  // anew, and so is one that was not heard of for longer than the window.
  rate(at, value) {
    const { samples } = this;
    const last = samples.at(-1);
    const gap = last && at - last.at >= window_seconds;
    if (last && (value < last.value || at < last.at || gap)) samples.length = 0;
    if (!last || at > last.at || samples.length === 0) samples.push({ at, value });
    while (samples.length > 2 && at - samples[1].at >= window_seconds) samples.shift();
    if (samples.length > samples_max) samples.splice(1, 1);
    const [oldest] = samples;
    return at > oldest.at ? (value - oldest.value) / (at - oldest.at) : NaN;
  }
}

// Holds the largest value of the last `window_seconds`. Memory is fixed.
export class peak_meter {
  constructor() {
    this.samples = [];
  }

  peak(at, value) {
    let { samples } = this;
    if (samples.length > 0 && at < samples.at(-1).at) samples = [];
    // What is both older and smaller than the newest can never be the largest again.
    samples = samples.filter((each) => at - each.at < window_seconds && each.value > value);
    samples.push({ at, value });
    this.samples = samples.slice(-samples_max);
    return this.samples[0].value;
  }
}

// A row of `cells` cells, the first of them its head.
function row_of(cells) {
  const row = make("tr", {}, make("th", { scope: "row" }));
  for (let cell = 1; cell < cells; cell += 1) row.append(make("td"));
  return row;
}

// The topic of a row, a link to its path where it has one, over its type.
function write_topic(cell, { topic, type }, drawable) {
  const tag = drawable ? "A" : "SPAN";
  if (cell.firstChild?.tagName !== tag) {
    cell.replaceChildren(make(tag), make("small"));
    if (drawable) cell.firstChild.href = `#${encodeURI(topic)}`;
  }
  write(cell.firstChild, topic);
  write(cell.lastChild, type || text.untyped);
  cell.title = `${topic} ${type ?? ""}`;
}

// Topics of the endpoint itself, which stand last.
const is_own = ({ topic }) => topic.startsWith("/rowe/");

export class rate_table {
  constructor(body) {
    this.body = body;
    this.meters = new Map();
  }

  // `at` is the endpoint's time in seconds, `shown` the topic whose path is drawn, `drawable(topic)` whether
  // a topic has a path. The rate is that of the count of messages; the endpoint's own, of a tenth of a
  // second, stands in.
  show(topics, at, shown, drawable) {
    const listed = [...topics].sort((one, other) => is_own(one) - is_own(other)).slice(0, names_max);
    const names = listed.map(({ topic }) => topic);
    for (const name of this.meters.keys()) if (!names.includes(name)) this.meters.delete(name);
    const rows = children_of(this.body, names, () => row_of(6));
    listed.forEach((entry, index) => {
      const row = rows[index];
      const cells = row.children;
      write_topic(cells[0], entry, drawable(entry.topic));
      const meters = this.#meters_of(entry.topic);
      const hertz = meters.rate.rate(at, entry.messages);
      // The first gap told may be the pause before anybody listened.
      const gap = Number.isFinite(hertz) ? meters.gap.peak(at, entry.gap_ms_max) : NaN;
      write(cells[1], rate(Number.isFinite(hertz) ? hertz : entry.rate_hz));
      write(cells[2], fixed(gap, gap < 100 ? 1 : 0));
      write(cells[3], count(entry.bytes));
      write(cells[4], count(entry.subscribers));
      write(cells[5], count(entry.messages));
      cells[4].className = cells[5].className = "wide";
      if (entry.topic === shown) row.setAttribute("aria-current", "true");
      else row.removeAttribute("aria-current");
    });
  }

  #meters_of(topic) {
    if (!this.meters.has(topic)) this.meters.set(topic, { rate: new rate_meter(), gap: new peak_meter() });
    return this.meters.get(topic);
  }
}

// One group of counters.
export class loss_table {
  constructor(body, labels) {
    this.body = body;
    this.labels = labels;
    this.meters = new Map();
  }

  // `counters` maps names to counts since start, `at` is the endpoint's time in seconds. Known counters that
  // the endpoint does not mention are shown with a dash, those that the page does not know by their own name.
  show(counters, at) {
    const strangers = Object.keys(counters).filter((name) => !(name in losses) && !(name in thinned));
    const unlabelled = this.labels === losses ? strangers : [];
    const names = [...Object.keys(this.labels), ...unlabelled].slice(0, names_max);
    for (const name of this.meters.keys()) if (!names.includes(name)) this.meters.delete(name);
    const rows = children_of(this.body, names, () => row_of(3));
    names.forEach((name, index) => {
      const value = counters[name];
      if (!this.meters.has(name)) this.meters.set(name, new rate_meter());
      const per_second = typeof value === "number" ? this.meters.get(name).rate(at, value) : NaN;
      const [label, total, each] = rows[index].children;
      write(label, this.labels[name] ?? name.replaceAll("_", " "));
      write(total, count(value));
      write(each, rate(per_second));
      rows[index].toggleAttribute("data-some", per_second > 0);
    });
  }
}

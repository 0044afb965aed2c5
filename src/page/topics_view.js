// SPDX-License-Identifier: Apache-2.0
// The topics: how often each says something, and, of those that are opened, what, as it comes.

import { children_of, element, make, mark, write } from "./dom.js";
import { count, fixed, rate } from "./numbers.js";
import { peak_meter, rate_meter } from "./meters.js";
import { text } from "./text.js";
import { copy, show_tree } from "./tree.js";

const value_hz = 5;       // of an opened topic
const copied_ms = 2000;   // so long a button says what it did
const topics_max = 64;    // shown: search finds the others
const is_own = ({ topic }) => topic.startsWith("/rowe/");

export class topics_view {
  #feeds;
  #meters = new Map();
  #opened = new Map();  // topic → {feed, last}
  #visible = false;
  #plots;

  // `plots` as plot_view.
  constructor(feeds, plots) {
    this.#feeds = feeds;
    this.#plots = plots;
    this.body = element("rates");
  }

  // Nothing is asked for that nobody sees.
  visible(visible) {
    this.#visible = visible;
    for (const { feed } of this.#opened.values()) feed.at(visible ? value_hz : 0);
  }

  // `at` is the endpoint's time in seconds. The rate is that of the count of messages; the endpoint's own, of
  // a tenth of a second, stands in.
  show(topics, at, left_out = 0) {
    const wanted = element("find_topic").value.trim().toLowerCase();
    const found = topics.filter(({ topic, type }) => `${topic} ${type}`.toLowerCase().includes(wanted));
    const listed = found.sort((one, other) => is_own(one) - is_own(other)).slice(0, topics_max);
    const names = new Set(topics.map(({ topic }) => topic));
    for (const name of this.#meters.keys()) if (!names.has(name)) this.#meters.delete(name);
    const all = topics.length + left_out;
    write(element("topics_count"), listed.length < all ? text.some_of(listed.length, all) : count(all));
    const rows = children_of(this.body, listed.map(({ topic }) => topic), (topic) => this.#row(topic));
    for (const entry of topics) this.#measure(entry, at);
    listed.forEach((entry, index) => this.#write(rows[index], entry));
  }

  #measure({ topic, messages, gap_ms_max, rate_hz, counted }, at) {
    if (!this.#meters.has(topic)) this.#meters.set(topic, { rate: new rate_meter(), gap: new peak_meter() });
    const meters = this.#meters.get(topic);
    // A recording has counted them itself.
    if (counted) return Object.assign(meters, { hertz: rate_hz, gap_ms: gap_ms_max });
    const hertz = meters.rate.rate(at, messages);
    meters.hertz = Number.isFinite(hertz) ? hertz : rate_hz;
    // The first gap told may be the pause before anybody listened.
    meters.gap_ms = Number.isFinite(hertz) ? meters.gap.peak(at, gap_ms_max) : NaN;
  }

  #row(topic) {
    const name = make("span", { className: "name" }, make("span", { textContent: topic }), make("small"));
    const head = make("button", { type: "button" }, name, make("span"), make("span"));
    mark(head, "aria-expanded", this.#opened.has(topic));
    head.onclick = () => this.#toggle(topic, head, body);
    const tree = make("div", { className: "values" });
    const take = make("button", { type: "button", className: "b", textContent: text.copy });
    take.ariaLabel = text.copy_of(topic);
    take.onclick = async () => {
      await copy(JSON.stringify(this.#opened.get(topic)?.last ?? null, null, 2));
      write(take, text.copied);
      setTimeout(() => write(take, text.copy), copied_ms);
    };
    const said = make("p", { className: "quiet" });
    const body = make("div", { className: "tree" }, tree, said, take);
    body.hidden = !this.#opened.has(topic);
    return make("div", { className: "row" }, head, body);
  }

  #toggle(topic, head, body) {
    const open = this.#opened.get(topic);
    if (open) {
      open.feed.end();
      this.#opened.delete(topic);
    } else {
      const made = { last: undefined, feed: null, opened: new Set() };  // the lists whose items are shown
      // Whatever its size, it is not on the connection of the stop.
      const ways = { apart: true, jumped: () => (made.last = undefined) };
      made.feed = this.#feeds.want(topic, (msg) => (made.last = msg), this.#visible ? value_hz : 0, ways);
      this.#opened.set(topic, made);
    }
    mark(head, "aria-expanded", !open);
    body.hidden = Boolean(open);
  }

  #write(row, { topic, type, bytes, subscribers, counted, messages }) {
    const [head, body] = row.children;
    const [name, hertz, gap] = head.children;
    const meters = this.#meters.get(topic);
    write(name.children[1], type || text.untyped);
    write(hertz, rate(meters.hertz));
    write(gap, fixed(meters.gap_ms, meters.gap_ms < 100 ? 1 : 0));
    const open = this.#opened.get(topic);
    if (!open) return;
    const [tree, said, take] = body.children;
    const ways = {
      opened: open.opened,
      full: this.#plots.full,
      has: (path) => this.#plots.names.includes(`${topic}:${path}`),
      toggle: (path) => this.#plots.toggle(`${topic}:${path}`),
    };
    const cut = open.last !== undefined && show_tree(tree, open.last, ways);
    take.hidden = open.last === undefined;
    const more = (cut ? text.leaves(cut) : "") + (ways.full ? text.plots_full : "");
    write(said, open.feed.refused ?? (open.last === undefined ? text.nothing_yet
      : counted ? text.recorded_about(bytes, messages) + more : text.topic_about(bytes, subscribers) + more));
  }
}

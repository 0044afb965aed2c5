// SPDX-License-Identifier: Apache-2.0
// Numbers over time: any numeric member of any topic, a few at once, each in a lane of its own, so that 24 V
// never flatten 0.4 m/s. What draws the lines, dygraphs, is loaded when the first plot is opened.

import { children_of, element, make, mark, write } from "./dom.js";
import { clock } from "./numbers.js";
import { colours, look_of, without_legend } from "./plot_look.js";
import { text } from "./text.js";
import { at_path, shown_value } from "./tree.js";

const plots_max = 4;
const plot_hz = 30;
const points_max = 9000;       // five minutes of them
const draw_ms = 100;           // at the least; and drawing takes no more than a tenth of the time:
const rest_share = 10;         // a press of STOP waits for what is being drawn
const spans_s = [60, 10, 300];  // what is usual first
const lane_px = 150;
const load_again_ms = 5000;

let dygraphs = null;  // once it is loaded
let loading = false;
// A script of its own kind, which leaves its name in the window; its style comes with it.
function load() {
  if (loading) return;
  loading = true;
  import("./dygraph.min.js").then(() => {
    document.head.append(make("link", { rel: "stylesheet", href: "dygraph.min.css" }));
    dygraphs = without_legend(globalThis.Dygraph);
  }).catch(() => setTimeout(() => (loading = false), load_again_ms));
}

class lane {
  points = [];   // [date here, number]; the number is null where nothing was known
  last = null;

  constructor(feeds, name, past_ms) {
    const [topic, path] = name.split(/:(.*)/s);
    Object.assign(this, { name, topic, path, feeds });
    this.ways = { apart: true, past_ms, jumped: () => this.#forget() };  // it may be large
    this.feed = feeds.want(topic, (msg, { at_ms }) => this.#take(msg, at_ms), 0, this.ways);
  }

  // Nothing is asked for that nobody sees; the line has a gap there.
  visible(visible) {
    this.feed.at(visible ? plot_hz : 0);
    if (!visible) this.gap();
  }

  // Those from a time on, with the one before: a line comes in from the left.
  since(begin_ms) {
    const first = this.points.findIndex(([at]) => Number(at) >= begin_ms);
    return this.points.slice(first < 0 ? -1 : Math.max(0, first - 1));
  }

  gap() {
    if (this.feeds.knows_past || this.points.at(-1)?.[1] === null) return;
    this.#add(null, this.feeds.now_ms);
  }

  // More is shown of the time before, or less.
  look_back(past_ms) {
    if (past_ms === this.ways.past_ms) return;
    this.ways.past_ms = past_ms;
    if (this.feeds.knows_past) this.feed.again();
  }

  #forget() {
    this.points = [];
    this.last = null;
  }

  #take(msg, at_ms) {
    const value = at_path(msg, this.path);
    this.last = typeof value === "number" && Number.isFinite(value) ? value : null;
    this.#add(this.last, at_ms);
  }

  #add(value, at_ms) {
    this.points.push([new Date(at_ms), value]);
    if (this.points.length > points_max) this.points.splice(0, points_max / 10);
  }
}

export class plot_view {
  #feeds;
  #lanes = [];
  #graphs = new Map();  // of the lanes, by their name
  #visible = false;
  #paused_at = null;
  #span_s = spans_s[0];
  #draws_at = 0;
  changed = () => {};

  constructor(robot, feeds) {
    this.#feeds = feeds;
    robot.on("closed", () => this.#lanes.forEach((one) => one.gap()));
    const pause = element("pause");
    pause.onclick = () => {
      this.#paused_at = this.#paused_at === null ? feeds.now_ms : null;
      mark(pause, "aria-pressed", this.#paused_at !== null);
    };
    const span = element("span");
    const listed = [...spans_s].sort((one, other) => one - other);
    span.append(...listed.map((each) => new Option(text.span(each), each)));
    span.value = this.#span_s;
    span.onchange = () => {
      this.#span_s = Number(span.value);
      this.#look_back();
      this.changed();
    };
  }

  // What a link carries.
  get arranged() { return { plot: this.names, span: this.#span_s === spans_s[0] ? null : this.#span_s }; }
  arrange({ plot, span }) {
    this.#span_s = spans_s.includes(span) ? span : spans_s[0];
    element("span").value = this.#span_s;
    this.#look_back();
    this.show(plot);
  }

  get #past_ms() { return this.#span_s * 1000; }
  #look_back() { for (const one of this.#lanes) one.look_back(this.#past_ms); }

  get names() { return this.#lanes.map(({ name }) => name); }

  // Plots these values, topic:path each, and no others.
  show(names) {
    const wanted = [...new Set(names)].filter((name) => /^\/[^:]*:./.test(name)).slice(0, plots_max);
    for (const one of this.#lanes) if (!wanted.includes(one.name)) this.#end(one);
    this.#lanes = wanted.map((name) =>
      this.#lanes.find((one) => one.name === name) ?? new lane(this.#feeds, name, this.#past_ms));
    for (const one of this.#lanes) one.feed.at(this.#visible ? plot_hz : 0);
    element("plot_none").hidden = wanted.length > 0;
    const rows = children_of(element("lanes"), wanted, (name) => this.#row(name));
    rows.forEach((row, index) => row.style.setProperty("--line-of", `var(${colours[index]})`));
  }

  toggle(name) {
    const { names } = this;
    if (names.includes(name)) this.show(names.filter((each) => each !== name));
    else if (this.full) return;
    else this.show([...names, name]);
    this.changed();
  }
  get full() { return this.#lanes.length >= plots_max; }

  visible(visible) {
    if (visible === this.#visible) return;
    this.#visible = visible;
    for (const one of this.#lanes) one.visible(visible);
  }

  #row(name) {
    const gone = make("button", { type: "button", className: "b", textContent: text.remove });
    gone.ariaLabel = text.remove_plot(name);
    gone.onclick = () => this.toggle(name);
    const head = make("p", {}, make("code", { textContent: name }), make("b"), gone);
    const at = make("div", { className: "lane" });
    at.setAttribute("role", "img");
    at.ariaLabel = text.plot_of(name);
    return make("section", { className: "card" }, head, at);
  }

  #end(one) {
    one.feed.end();
    this.#graphs.get(one.name)?.destroy();
    this.#graphs.delete(one.name);
  }

  turn() {
    if (!this.#visible || document.hidden || performance.now() < this.#draws_at) return;
    this.#draws_at = performance.now() + draw_ms;
    this.#lanes.forEach((one, index) => {
      const row = element("lanes").children[index];
      const fresh = one.feed.fresh(1000);
      const said = one.last === null ? text.nothing_yet : shown_value(one.last);
      write(row.querySelector("b"), one.feed.refused ?? said);
      mark(row, "data-old", !fresh);
      this.#draw(one, row.querySelector(".lane"));
    });
  }

  #draw(one, at) {
    if (!dygraphs) return load();
    if (one.points.length === 0) return;
    const now_ms = this.#feeds.now_ms;
    const end = this.#feeds.knows_past ? now_ms : this.#paused_at ?? now_ms;
    const style = getComputedStyle(at);
    const options = {
      file: one.since(end - this.#span_s * 1000), dateWindow: [end - this.#span_s * 1000, end],
      ...look_of(style), colors: [style.getPropertyValue("--line-of").trim()],
    };
    const graph = this.#graphs.get(one.name);
    const began = performance.now();
    if (graph) {
      graph.updateOptions(options);
      if (graph.size().width !== at.clientWidth) graph.resize(at.clientWidth, lane_px);
      const now = performance.now();
      this.#draws_at = Math.max(this.#draws_at, now) + rest_share * (now - began);
      return;
    }
    const { file, ...more } = options;
    this.#graphs.set(one.name, new dygraphs(at, file, {
      ...more, labels: ["t", one.name], height: lane_px, width: at.clientWidth, interactionModel: {},
      axes: { x: { axisLabelFormatter: (at_ms) => clock(this.#feeds.clock_ms(Number(at_ms))) } },
    }));
  }
}

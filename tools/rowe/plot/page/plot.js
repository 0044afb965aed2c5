// SPDX-License-Identifier: Apache-2.0
// The script of an HTML file of `rowe plot`. The data stand in the file itself; dygraphs, which draws them,
// was run before this. All lanes show the same time: who zooms into one zooms into all.

import { colours, look_of, without_legend } from "../../../../src/page/plot_look.js";

const data = JSON.parse(document.getElementById("data").textContent);
const Dygraph = without_legend(globalThis.Dygraph);
const dash = [null, [8, 4], [2, 3]];
const stop_alpha = 0.14;
const stop_px = 2;
const gap_px = 4;
const loss_px = [2, 9];
const digits = 6;
const graphs = [];

function make(tag, members = {}, ...children) {
  const made = Object.assign(document.createElement(tag), members);
  made.append(...children);
  return made;
}

const count = (n) => n.toLocaleString("en").replaceAll(",", "\u202f");
const counted = (n, thing) => `${count(n)} ${thing}${n === 1 ? "" : "s"}`;

// Rows of all fields of a lane, by time. What a field has not at a time is null, which its line passes over;
// NaN breaks it.
function rows_of(fields) {
  const rows = new Map();
  const row_at = (t) => {
    if (!rows.has(t)) rows.set(t, [t, ...fields.map(() => null)]);
    return rows.get(t);
  };
  fields.forEach(({ t, v, gaps }, index) => {
    t.forEach((at, n) => (row_at(at)[index + 1] = v[n]));
    for (const [from, to] of gaps) row_at((from + to) / 2)[index + 1] = NaN;
  });
  return [...rows.values()].sort((one, other) => one[0] - other[0]);
}

// Under the lines of a lane: stops, gaps and losses.
function draw_marks(lane, context, area, graph) {
  const style = getComputedStyle(graph.graphDiv);
  const colour = (name) => style.getPropertyValue(name).trim();
  const x_of = (t) => Math.min(Math.max(graph.toDomXCoord(t), area.x), area.x + area.w);
  const bar = (from, to, top, height) =>
    context.fillRect(x_of(from), top, Math.max(x_of(to) - x_of(from), 1), height);
  const [begin, end] = graph.xAxisRange();
  const is_seen = (from, to) => to >= begin && from <= end;
  const bottom = area.y + area.h;
  context.save();
  context.fillStyle = colour("--stop");
  for (const { from, to } of data.stops.filter((one) => is_seen(one.from, one.to))) {
    context.globalAlpha = stop_alpha;
    bar(from, to, area.y, area.h);
    context.globalAlpha = 1;
    if (from >= begin) context.fillRect(Math.round(x_of(from)), area.y, stop_px, area.h);
  }
  context.fillStyle = colour("--quiet");
  for (const [from, to] of lane.gaps) if (is_seen(from, to)) bar(from, to, bottom - gap_px, gap_px);
  context.fillStyle = colour("--warn");
  for (const [at] of lane.lost) {
    if (is_seen(at, at)) context.fillRect(Math.round(x_of(at)), bottom - gap_px - loss_px[1], ...loss_px);
  }
  context.restore();
}

function mark(words, variable) {
  const made = make("span", { textContent: words });
  made.style.setProperty("--mark", `var(${variable})`);
  return made;
}

function show_marks(at) {
  for (const { from, to, number, cause, source } of data.stops) {
    const by = source === "" ? cause : `${cause} by ${source}`;
    const when = `at ${from} s, for ${(to - from).toFixed(3)} s`;
    at.append(mark(`stop ${number} ${when}${by && `: ${by}`}`, "--stop"));
  }
  if (data.gaps > 0) at.append(mark(counted(data.gaps, "gap"), "--quiet"));
  if (data.lost > 0) at.append(mark(`${counted(data.lost, "message")} lost`, "--warn"));
}

// Shows the same time in all lanes.
function zoom_all(one) {
  const range = one.xAxisRange();
  for (const other of graphs) {
    const [begin, end] = other.xAxisRange();
    if (other !== one && (begin !== range[0] || end !== range[1])) other.updateOptions({ dateWindow: range });
  }
}

function show_lane(lane, into) {
  const values = lane.fields.map(() => make("b"));
  const names = lane.fields.map(({ name, unit, samples, kept }, index) => {
    const thinned = kept < samples ? `${count(kept)} of ${counted(samples, "sample")}` : "";
    const item = make("li", {}, make("code", { textContent: unit === "" ? name : `${name} [${unit}]` }),
      values[index], make("small", { textContent: thinned }));
    item.style.setProperty("--line-of", `var(${colours[index % colours.length]})`);
    return item;
  });
  const at = make("div", { className: "lane" });
  into.append(make("section", {}, make("ul", {}, ...names), at));
  const style = () => getComputedStyle(at);
  const look = () => ({
    ...look_of(style()), strokeWidth: 1.5,
    colors: lane.fields.map((_, index) => style().getPropertyValue(colours[index % colours.length]).trim()),
  });
  const labels = lane.fields.map(({ name }) => name);
  const rows = rows_of(lane.fields);
  const graph = new Dygraph(at, rows.length > 0 ? rows : [[data.from, ...labels.map(() => null)]], {
    ...look(), labels: ["t", ...labels], dateWindow: [data.from, data.to],
    connectSeparatedPoints: true, drawGapEdgePoints: true,
    series: Object.fromEntries(labels.map((name, index) =>
      [name, { strokePattern: dash[Math.floor(index / colours.length) % dash.length] }])),
    axes: { y: { axisLabelWidth: 70 } },
    underlayCallback: (...drawn) => draw_marks(lane, ...drawn),
    drawCallback: (drawn, is_first) => { if (!is_first) zoom_all(drawn); },
    highlightCallback: (_, x, points) => {
      values.forEach((value) => (value.textContent = ""));
      for (const { name, yval } of points) {
        if (!Number.isNaN(yval)) values[labels.indexOf(name)].textContent = Number(yval.toPrecision(digits));
      }
    },
    unhighlightCallback: () => values.forEach((value) => (value.textContent = "")),
  });
  graphs.push(graph);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () =>
    graph.updateOptions(look()));
}

document.querySelector("h1").textContent = data.title;
show_marks(document.getElementById("marks"));
document.documentElement.style.setProperty("--lanes", data.lanes.length);
data.lanes.forEach((lane) => show_lane(lane, document.querySelector("main")));
const thins = data.lanes.some(({ fields }) => fields.some(({ kept, samples }) => kept < samples));
const foot = [
  `${data.caption}.`, "Drag to zoom in, press shift to move, click twice to see all.",
  thins ? "Of each column the first, last, lowest and highest sample is drawn." : "",
];
document.getElementById("foot").textContent = foot.filter(Boolean).join(" ");

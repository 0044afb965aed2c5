// SPDX-License-Identifier: Apache-2.0
// The values of a message, each with the path that leads to it. Pure functions, and the list that shows them.

import { children_of, element, make, mark, write } from "./dom.js";
import { absent } from "./numbers.js";
import { text } from "./text.js";

const leaves_max = 256;    // shown of one message
const items_max = 16;      // of a list, one by one; longer ones by their length

// What has a meaning in a path is written as %2E, say, in a name.
const escaped = (sign) => `%${sign.charCodeAt().toString(16).toUpperCase()}`;
const unescaped = (step) =>
  step.replace(/%(2[5CE]|3A|5[BD])/g, (_, code) => String.fromCharCode(`0x${code}`));

// [path, value] of all that is no object. A list of more than a few items is one value.
export function leaves_of(value, path = "", into = []) {
  if (into.length >= leaves_max) return into;
  const inner = value !== null && typeof value === "object" &&
    !(Array.isArray(value) && (value.length > items_max || value.length === 0));
  if (!inner) {
    into.push([path, value]);
    return into;
  }
  for (const [name, each] of Object.entries(value)) {
    const step = name.replace(/[.,:%[\]]/g, escaped);
    leaves_of(each, path === "" ? step : Array.isArray(value) ? `${path}[${step}]` : `${path}.${step}`, into);
  }
  return into;
}

// What a path leads to; undefined: nothing.
export function at_path(value, path) {
  return path.split(/[.[\]]+/).filter(Boolean).map(unescaped).reduce((at, name) => at?.[name], value);
}

// In few characters: a number with the digits that count, a list by its length.
export function shown_value(value) {
  if (value === null || value === undefined) return absent;
  if (Array.isArray(value)) return text.items(value.length);
  if (typeof value !== "number" || Number.isInteger(value)) return String(value);
  const size = Math.abs(value);
  const digits = size >= 1000 ? 1 : size >= 0.001 ? 4 : null;
  return (digits === null ? value.toExponential(2) : value.toFixed(digits)).replace("-", "\u2212");
}

// Shows what `message` holds now; rows stay as long as their paths do. Numbers can be plotted:
// `plots.has(path)` says whether one is, `plots.toggle(path)` changes that, and `plots.full` forbids others.
export function show_tree(at, message, plots) {
  const leaves = leaves_of(message);
  const rows = children_of(at, leaves.map(([path]) => path), (path) => {
    const plot = make("button", { type: "button", className: "plot", textContent: text.plot });
    plot.ariaLabel = text.plot_value(path);
    plot.onclick = () => plots.toggle(path);
    return make("div", {}, make("code", { textContent: path }), make("span"), plot);
  });
  leaves.forEach(([path, value], index) => {
    const [, shown, plot] = rows[index].children;
    write(shown, shown_value(value));
    plot.hidden = typeof value !== "number";
    const has = plots.has(path);
    mark(plot, "aria-pressed", has);
    plot.disabled = plots.full && !has;
  });
}

// Puts words where others can paste them. Pages without TLS have no clipboard, but for what is selected.
export async function copy(words) {
  try {
    await navigator.clipboard.writeText(words);
  } catch {
    const box = element("copied");
    box.hidden = false;
    box.value = words;
    box.select();
    document.execCommand("copy");
    box.hidden = true;
  }
}

// SPDX-License-Identifier: Apache-2.0
// The values of a message, each with the path that leads to it. Pure functions, and the list that shows them.

import { children_of, element, make, mark, write } from "./dom.js";
import { absent } from "./numbers.js";
import { text } from "./text.js";

export const leaves_max = 1024;  // shown of one message
const items_max = 16;            // of a list, one by one; a longer one by its length until it is opened
const is_long = (value) => Array.isArray(value) && value.length > items_max;

// What has a meaning in a path is written as %2E, say, in a name.
const escaped = (sign) => `%${sign.charCodeAt().toString(16).toUpperCase()}`;
const unescaped = (step) =>
  step === "%00" ? "" : step.replace(/%(2[5CE]|3A|5[BD])/g, (_, code) => String.fromCharCode(`0x${code}`));

// [path, value] of all that is no object. A list of more than a few items is one value, unless its path is
// among `opened`.
export function leaves_of(value, opened = new Set(), path = "", into = []) {
  if (into.length >= leaves_max) return into;
  const inner = value !== null && typeof value === "object" &&
    !(is_long(value) && !opened.has(path)) && !(Array.isArray(value) && value.length === 0);
  if (!inner) {
    into.push([path, value]);
    return into;
  }
  for (const [name, each] of Object.entries(value)) {
    const step = name === "" ? "%00" : name.replace(/[.,:%[\]]/g, escaped);
    const inside = path === "" ? step : Array.isArray(value) ? `${path}[${step}]` : `${path}.${step}`;
    leaves_of(each, opened, inside, into);
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
// `ways.has(path)` says whether one is, `ways.toggle(path)` changes that, and `ways.full` forbids others.
// Lists in `ways.opened` are shown by their items. Returns how many values are shown if that is not all, else
// 0.
export function show_tree(at, message, ways) {
  const leaves = leaves_of(message, ways.opened);
  const rows = children_of(at, leaves.map(([path]) => path), (path) => {
    const act = make("button", { type: "button", className: "plot" });
    return make("div", {}, make("code", { textContent: path }), make("span"), act);
  });
  leaves.forEach(([path, value], index) => {
    const [, shown, act] = rows[index].children;
    write(shown, shown_value(value));
    if (is_long(value)) {
      act.hidden = false;
      write(act, text.show_items);
      mark(act, "aria-label", text.show_items_of(path));
      act.onclick = () => ways.opened.add(path);
      return;
    }
    act.hidden = typeof value !== "number";
    if (act.hidden) return;
    const has = ways.has(path);
    write(act, text.plot);
    mark(act, "aria-label", text.plot_value(path));
    mark(act, "aria-pressed", has);
    act.disabled = ways.full && !has;
    act.onclick = () => ways.toggle(path);
  });
  return leaves.length >= leaves_max ? leaves.length : 0;
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

// SPDX-License-Identifier: Apache-2.0
// A form for a value of a type, made from its description in /rowe/types (description.hpp says what is in
// one), and the value that somebody filled in. Where nothing is known of a type, the form is a text of JSON.

import { make } from "./dom.js";
import { text } from "./text.js";

const whole = /^u?int/;
const lengths_max = 256;
const plain = (number) => String(number).replace("-", "\u2212");

// What a value is before anybody has filled in one.
export function blank_of(value) {
  if (value.is === "object") {
    return Object.fromEntries(value.object.members.map((each) => [each.name, blank_of(each)]));
  }
  if (value.names) return value.by_name ? value.names[0][0] : value.names[0][1];
  const blanks = { boolean: false, text: "", array: [], optional: null };
  return value.is in blanks ? blanks[value.is] : 0;
}

function json_of(words, name) {
  try {
    return JSON.parse(words);
  } catch {
    throw new TypeError(text.no_json(name));
  }
}

// The robot refuses what is not in this range, so a person is told before.
function range_of({ is, least, most }) {
  if (is === "text" || is === "array") return "";
  if (least !== undefined && most !== undefined) return text.from_to(plain(least), plain(most));
  if (least !== undefined) return text.from(plain(least));
  return most === undefined ? "" : text.up_to(plain(most));
}

// One field, and what reads it.
function field_of(name, value) {
  const bounds = range_of(value);
  const label = make("span", {}, name, ...(bounds ? [make("small", { textContent: bounds })] : []));
  if (value.is === "boolean") {
    const box = make("input", { type: "checkbox" });
    return [make("label", {}, label, box), () => box.checked, (now) => (box.checked = now === true)];
  }
  if (value.names) {
    const choice = make("select", { className: "field" },
      ...value.names.map(([word, number]) => new Option(word, value.by_name ? word : String(number))));
    return [make("label", {}, label, choice), () => (value.by_name ? choice.value : Number(choice.value)),
      (now) => (choice.value = String(now))];
  }
  const box = make("input", { className: "field", autocomplete: "off", spellcheck: false });
  const made = make("label", {}, label, box);
  if (value.is === "text") {
    box.maxLength = Math.min(value.most ?? lengths_max, lengths_max);
    return [made, () => box.value, (now) => (box.value = String(now))];
  }
  if (value.is === "array" || value.is === "optional" || value.is === "json") {
    return [made, () => json_of(box.value, name), (now) => (box.value = JSON.stringify(now))];
  }
  Object.assign(box, { inputMode: "decimal" });
  const read = () => {
    const number = Number(box.value.trim().replace("\u2212", "-") || NaN);
    if (!Number.isFinite(number)) throw new TypeError(text.no_number(name));
    if (whole.test(value.is) && !Number.isInteger(number)) throw new TypeError(text.no_integer(name));
    if (whole.test(value.is) && !value.as_string && !Number.isSafeInteger(number)) {
      throw new TypeError(text.too_large(name));
    }
    return value.as_string ? box.value.trim() : number;
  };
  return [made, read, (now) => (box.value = String(now))];
}

export class form {
  #fields = [];  // {path, read, write}

  // `value` as of a member in a description; `name` may be empty for an object.
  constructor(name, value) {
    this.at = make("div", { className: "fields" });
    this.#add(name, value, []);
    this.write(blank_of(value));
  }

  #add(name, value, path) {
    if (value.is === "object" && value.object.members.length > 0) {
      for (const each of value.object.members) {
        this.#add(name ? `${name}.${each.name}` : each.name, each, [...path, each.name]);
      }
      return;
    }
    const known = value.is === "object" ? { is: "json" } : value;
    const [at, read, write] = field_of(name || text.request, known);
    this.#fields.push({ path, read, write });
    this.at.append(at);
  }

  write(value) {
    for (const { path, write } of this.#fields) write(path.reduce((at, name) => at?.[name], value));
  }

  // Throws with words for a person where something is not what the type wants.
  read() {
    let whole_value = {};
    for (const { path, read } of this.#fields) {
      if (path.length === 0) whole_value = read();
      else {
        const inner = path.slice(0, -1).reduce((at, name) => (at[name] ??= {}), whole_value);
        inner[path.at(-1)] = read();
      }
    }
    return whole_value;
  }
}

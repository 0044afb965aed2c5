// SPDX-License-Identifier: Apache-2.0
// What all parts of the page need of the document.

export const element = (id) => document.getElementById(id);

// Sets the words of an element, if they changed: ten times a second most do not.
export function write(cell, words) {
  if (cell.textContent !== words) cell.textContent = words;
}

// Sets an attribute, if it changed: each change makes the browser look at its styles anew.
export function mark(at, name, value) {
  if (at.getAttribute(name) !== String(value)) at.setAttribute(name, String(value));
}

export function make(tag, members = {}, ...children) {
  const made = Object.assign(document.createElement(tag), members);
  made.append(...children);
  return made;
}

// What one may choose from, unless there is no choice; `chosen` is what holds now.
export function choose_from(choice, names, chosen) {
  if (names.join("\n") !== [...choice.options].map(({ value }) => value).join("\n")) {
    choice.replaceChildren(...names.map((name) => new Option(name, name)));
  }
  if (names.includes(chosen) && choice.value !== chosen) choice.value = chosen;
  choice.parentElement.hidden = names.length < 2;
}

// The drawing `name` of index.html, in a mark that was made there.
export const draw = (at, name) => mark(at, "href", `#i-${name}`);

// Makes `parent` hold one child per key, in order, made by `make_one(key)`; those that stay are kept as they
// are, with what is open or typed in them.
export function children_of(parent, keys, make_one) {
  const kept = new Map([...parent.children].map((each) => [each.dataset.key, each]));
  for (const [key, each] of kept) if (!keys.includes(key)) each.remove();
  return keys.map((key, index) => {
    let child = kept.get(key);
    if (!child) {
      child = make_one(key);
      child.dataset.key = key;
    }
    if (parent.children[index] !== child) parent.insertBefore(child, parent.children[index] ?? null);
    return child;
  });
}

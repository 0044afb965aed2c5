// SPDX-License-Identifier: Apache-2.0
// Parameters and services, with forms made from their types. What a role may not set or call has no button.

import { children_of, element, make, mark, write } from "./dom.js";
import { form } from "./forms.js";
import { count } from "./numbers.js";
import { text } from "./text.js";

const is_own = (name) => name.startsWith("/rowe/") || name.startsWith("/rosapi/");
const services_ms_max = 10000;

// How a value is shaped whose type nobody describes.
const kinds = { boolean: "boolean", number: "float64", string: "text" };
const kind_of = (value) => ({ is: kinds[typeof value] ?? "json" });

// What /rowe/types says of services and parameters, by their names.
export async function ask_types(robot) {
  const services = new Map();
  const parameters = new Map();
  for (let from = 0, before = -1; from > before;) {  // null is none; nor does a robot have us ask for ever
    const { types, next } = await robot.call("/rowe/types", { from });
    for (const each of types) {
      if (each.service) services.set(each.service, each);
      if (each.parameter) parameters.set(each.parameter, each);
    }
    [before, from] = [from, next];
  }
  return { services, parameters };
}

// A row with a form keeps what somebody typed in it, unless it was made from another type than holds now.
const made_from = new WeakMap();
function rows_of(parent, names, types, make_row) {
  const type_of = (name) => JSON.stringify(types.get(name));
  for (const row of [...parent.children]) if (made_from.get(row) !== type_of(row.dataset.key)) row.remove();
  return children_of(parent, names, (name) => {
    const row = make_row(name);
    made_from.set(row, type_of(name));
    return row;
  });
}

export class parameters_view {
  #robot;
  #rights;
  #rows = new Map();
  #values = new Map();
  #types = new Map();

  constructor(robot, rights) {
    this.#robot = robot;
    this.#rights = rights;
  }

  get(name) { return this.#values.get(name); }

  // Values as they change.
  take(values) {
    for (const [name, value] of Object.entries(values)) this.#values.set(name, value);
    this.show();
  }

  // Asks for all there are, when somebody looks. `types` as of ask_types(); null: nobody told them.
  async ask(types) {
    this.#types = types?.parameters ?? this.#types;
    try {
      const { names } = await this.#robot.call("/rosapi/get_param_names");
      for (const name of names.filter((each) => !is_own(each))) {
        if (!this.#values.has(name)) await this.#get(name);
      }
    } catch {
      return;  // a role without the right, or no connection: nothing is shown that is not known
    }
    this.show();
  }

  async #get(name) {
    const { value, successful } = await this.#robot.call("/rosapi/get_param", { name });
    if (successful) this.#values.set(name, JSON.parse(value));
  }

  // Also when rights have become known.
  show() {
    const names = [...this.#values.keys()].sort();
    element("parameters").closest("section").hidden = names.length === 0;
    write(element("parameters_count"), count(names.length));
    rows_of(element("parameters"), names, this.#types, (name) => this.#row(name));
    for (const name of names) this.#write(name);
  }

  #row(name) {
    const made = new form(name, this.#types.get(name)?.value ?? kind_of(this.#values.get(name)));
    const set = make("button", { type: "submit", className: "b", textContent: text.set });
    const said = make("p", { className: "quiet" });
    said.setAttribute("role", "status");
    const at = make("form", { className: "row" }, made.at, set, said);
    const row = { at, made, set, said, changed: false };
    at.oninput = ({ target }) => {
      row.changed = target.value !== "";  // who empties a field wants to see what holds
      write(said, "");
      this.#write(name);
    };
    at.onsubmit = (event) => {
      event.preventDefault();
      this.#set(name, row);
    };
    this.#rows.set(name, row);
    return at;
  }

  #write(name) {
    const { made, set, changed } = this.#rows.get(name);
    const may = this.#rights.has("set", name);
    set.hidden = !may || !changed;
    for (const field of made.at.querySelectorAll("input, select")) {
      field.disabled = !may && field.type !== "text";  // others cannot be read only
      field.readOnly = !may;
    }
    if (!changed) made.write(this.#values.get(name));
  }

  async #set(name, row) {
    try {
      const value = row.made.read();
      await this.#robot.call("/rosapi/set_param", { name, value: JSON.stringify(value) });
      this.#values.set(name, value);
      row.changed = false;
      write(row.said, text.is_set);
    } catch (error) {
      write(row.said, String(error.said ?? error.message));
    }
    this.#write(name);
  }
}

export class services_view {
  #robot;
  #rights;
  #types = new Map();  // {type, request}
  #names = [];

  constructor(robot, rights) {
    this.#robot = robot;
    this.#rights = rights;
  }

  // `types` as of ask_types(); null: nobody told them.
  async ask(types) {
    this.#types = types?.services ?? this.#types;
    try {
      const { services } = await this.#robot.call("/rosapi/services");
      this.#names = services.filter((name) => !is_own(name)).sort();
    } catch {
      return;
    }
    this.show();
  }

  // Also when rights have become known.
  show() {
    element("services").closest("section").hidden = this.#names.length === 0;
    write(element("services_count"), count(this.#names.length));
    const rows = rows_of(element("services"), this.#names, this.#types, (name) => this.#row(name));
    rows.forEach((row, at) => (row.lastChild.hidden = !this.#rights.has("call", this.#names[at])));
  }

  #row(name) {
    const { type, request } = this.#types.get(name) ?? {};
    const made = new form("", { is: "object", object: request ?? { members: [] } });
    const call = make("button", { type: "submit", className: "b", textContent: text.call });
    call.ariaLabel = text.call_of(name);
    const said = make("pre", { className: "quiet" });
    said.setAttribute("role", "status");
    const about = make("small", { textContent: type || text.untyped });
    const title = make("p", { className: "name" }, name, about);
    const asks = make("div", {}, made.at, call, said);
    const at = make("form", { className: "row" }, title, asks);
    at.onsubmit = async (event) => {
      event.preventDefault();
      write(said, text.calling);
      mark(call, "disabled", "");
      try {
        const values = await this.#robot.call(name, made.read(), { timeout_ms: services_ms_max });
        write(said, JSON.stringify(values, null, 1));
      } catch (error) {
        write(said, String(error.said ?? error.message));
      }
      call.removeAttribute("disabled");
    };
    return at;
  }
}

// SPDX-License-Identifier: Apache-2.0
// @foxglove/rosmsg and its serializations, unmodified: they read the messages that we write, and we read
// theirs, of ROS's own types and of random ones.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { test } from "node:test";

const require = createRequire(import.meta.url);
const { parse, stringify } = require("@foxglove/rosmsg");
const common = require("@foxglove/rosmsg-msgs-common");
const ros1 = require("@foxglove/rosmsg-serialization");
const ros2 = require("@foxglove/rosmsg2-serialization");

const limit = { timeout: 300000 };

// ---- chance, the same in each run

let state = 1;
function below(bound) { // mulberry32
  state = (state + 0x6d2b79f5) | 0;
  let mixed = Math.imul(state ^ (state >>> 15), state | 1);
  mixed ^= mixed + Math.imul(mixed ^ (mixed >>> 7), mixed | 61);
  return ((mixed ^ (mixed >>> 14)) >>> 0) % bound;
}
const one_of = (list) => list[below(list.length)];
const repeat = (count, make) => Array.from({ length: count }, make);

// ---- types: {name, version, text, root, inner}

const times = {
  ros1: ["time", "duration"], ros2: ["builtin_interfaces/Time", "builtin_interfaces/msg/Duration"],
};
const words = (version) => ["bool", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64",
  "float32", "float64", "string", "byte", "char", ...times[version]];

const line = "=".repeat(80);
const defaults = {
  bool: ["true", "False"], int8: ["-128", "0x7f"], uint8: ["255"], int16: ["-3"], uint16: ["65535"],
  int32: ["-2147483648"], uint32: ["7"], int64: ["-9"], uint64: ["18446744073709551615"],
  float32: ["0.5", "-2"], float64: ["-1e3", ".25"], string: ['"a b"', "'it'", "word"], byte: ["1"],
  char: ["65"],
};

function random_text(version) {
  const count = 1 + below(5);
  // The parser takes two types without a difference for one, so only the last may be empty.
  const members = (at) => (at + 1 < count ? 1 : 0) + below(at === 0 ? 12 : 6);
  const part = (at) => repeat(members(at), (_, number) => {
    let type = at + 1 < count && below(3) === 0
      ? `${one_of(["", "test/"])}T${at + 1 + below(count - at - 1)}` : one_of(words(version));
    const name = `m${at}_${number}`;
    const basic = type;
    if (version === "ros2" && type === "string" && below(3) === 0) type += "<=40";
    const bounded = version === "ros2" ? `[<=${1 + below(9)}]` : "";
    const array = one_of(["", "", "", "[]", `[${1 + below(5)}]`, bounded]);
    const literals = version === "ros2" && array === "" && below(4) === 0 ? defaults[basic] : undefined;
    const comment = below(5) === 0 ? " # in metres" : "";
    return `${type}${array} ${name}${literals ? ` ${one_of(literals)}` : ""}${comment}\n`;
  }).concat(below(3) === 0 ? ["uint8 CONSTANT=7\n"] : []).join("");
  return repeat(count, (_, at) => (at === 0 ? "" : `${line}\nMSG: test/T${at}\n`) + part(at)).join("");
}

// The message and the types that it needs, as its text.
function common_text(all, name) {
  const needed = [name];
  for (const one of needed) {
    for (const { type, isComplex } of all[one].definitions) {
      if (isComplex && !needed.includes(type)) needed.push(type);
    }
  }
  return stringify(needed.map((one) => all[one]));
}

function type_of(name, version, text) {
  const definitions = parse(text, { ros2: version === "ros2" });
  return { name, version, text, definitions, root: definitions[0].definitions };
}
const fields = (definition) => definition.filter(({ isConstant }) => !isConstant);
const inner = ({ definitions }, field) => definitions.find(({ name }) => name === field.type).definitions;
// What the libraries do not take: wide strings, and messages of nothing but constants.
const is_taken = ({ definitions, root }) =>
  !definitions.some(({ definitions: of }) => of.some(({ type }) => type === "wstring"))
  && (root.length === 0 || fields(root).length > 0);
// Its writer takes an array of times that is left out for one time.
const is_taken_in_part = (type) => is_taken(type)
  && !type.definitions.some(({ definitions: of }) => of.some(({ type: word, isArray, arrayLength }) =>
    isArray && arrayLength === undefined && (word === "time" || word === "duration")));

// ---- values: what the libraries take

const whole = (bits, signed) => () => {
  const [least, most] = signed ? [-(2 ** (bits - 1)), 2 ** (bits - 1) - 1] : [0, 2 ** bits - 1];
  return one_of([least, most, 0, least + Math.floor(below(1 << 30) / (1 << 30) * (most - least))]);
};
const big = (signed) => () => {
  const bits = BigInt(below(2 ** 32)) << 32n | BigInt(below(2 ** 32));
  return signed ? BigInt.asIntN(64, bits) : bits;
};
function real(view_bits) {
  const view = new DataView(new ArrayBuffer(8));
  view.setUint32(0, below(2 ** 32));
  view.setUint32(4, below(2 ** 32));
  const wild = view_bits === 32 ? view.getFloat32(0) : view.getFloat64(0);
  const tame = (below(20001) - 10000) / 100;
  const x = one_of([wild, tame, tame, 0, -0, NaN]);
  if (Number.isNaN(x)) return NaN; // the one that both write
  return Math.abs(x) === Infinity ? 1 : view_bits === 32 ? Math.fround(x) : x;
}
// The writer for CDR counts the characters of a string for its bytes, so what it writes is ASCII.
const ascii_characters = ["a", " ", '"', "\\", "\n", "/"];
const all_characters = [...ascii_characters, "ä", "€", "😀"];
const string = (ascii) =>
  repeat(below(8), () => one_of(ascii ? ascii_characters : all_characters)).join("");
const makers = {
  bool: () => below(2) === 1, int8: whole(8, true), uint8: whole(8), int16: whole(16, true),
  uint16: whole(16), int32: whole(32, true), uint32: whole(32), int64: big(true), uint64: big(false),
  float32: () => real(32), float64: () => real(64), string: (_, ascii) => string(ascii),
  time: ({ version }) => ({ sec: whole(32, version === "ros2")(), nsec: whole(32)() }),
  duration: ({ version }) => ({ sec: whole(32, true)(), nsec: whole(32, version === "ros1")() }),
};

// `partial`: some members are left out.
function value_of(type, definition, ascii, partial) {
  const made = {};
  for (const field of fields(definition)) {
    if (partial && below(4) === 0) continue;
    const one = () => (field.isComplex ? value_of(type, inner(type, field), ascii, partial)
      : makers[field.type](type, ascii));
    const most = field.arrayUpperBound ?? (field.isComplex ? 3 : 20);
    made[field.name] = field.isArray ? repeat(field.arrayLength ?? below(most + 1), one) : one();
  }
  return made;
}

// ---- the JSON of a value, and what is said in JSON

const bytes_in = (field) => field.isArray && field.type === "uint8";
const number = (x) => (Number.isFinite(x) ? (Object.is(x, -0) ? "-0.0" : JSON.stringify(x)) : "null");

function json_of(type, definition, value) {
  const one = (field, x) => {
    if (field.isComplex) return json_of(type, inner(type, field), x);
    if (field.type === "time" || field.type === "duration") {
      return type.version === "ros1" ? `{"secs":${x.sec},"nsecs":${x.nsec}}`
        : `{"sec":${x.sec},"nanosec":${x.nsec}}`;
    }
    return typeof x === "bigint" ? `${x}` : typeof x === "number" ? number(x) : JSON.stringify(x);
  };
  const members = fields(definition).filter(({ name }) => name in value).map((field) => {
    const x = value[field.name];
    const text = bytes_in(field) && below(2) === 0 ? JSON.stringify(Buffer.from(x).toString("base64"))
      : field.isArray ? `[${[...x].map((element) => one(field, element)).join(",")}]` : one(field, x);
    return [below(1 << 20), `"${field.name}":${text}`];
  });
  if (below(2) === 0) members.sort(([a], [b]) => a - b); // any order
  return `{${members.map(([, text]) => text).join(below(2) === 0 ? "," : " , ")}}`;
}

// Values in the words of the JSON, each number by its digits.
function plain(type, definition, value, wanted) {
  const one = (field, x) => {
    if (field.isComplex) return plain(type, inner(type, field), x, wanted);
    if (field.type === "time" || field.type === "duration") {
      const [sec, nsec] = wanted ? [x.sec, x.nsec ?? x.nanosec] : type.version === "ros1" ? [x.secs, x.nsecs]
        : [x.sec, x.nanosec];
      assert.ok(wanted || Object.keys(x).length === 2);
      return `${sec} ${nsec}`;
    }
    if (field.type === "int64" || field.type === "uint64") return String(x);
    if (field.type.startsWith("float")) {
      const real = field.type === "float32" ? Math.fround(Number(x)) : Number(x);
      return x === null || !Number.isFinite(real) ? "null" : Object.is(real, -0) ? "-0" : String(real);
    }
    return typeof x === "string" ? `"${x}"` : String(x);
  };
  assert.deepEqual(Object.keys(value), fields(definition).map(({ name }) => name));
  return Object.fromEntries(fields(definition).map((field) => {
    const x = value[field.name];
    if (!field.isArray) return [field.name, one(field, x)];
    if (bytes_in(field)) return [field.name, wanted ? Buffer.from(x).toString("base64") : x];
    return [field.name, Array.from(x, (element) => one(field, element))];
  }));
}
// Integers beyond 2^53 as text, since JSON.parse() rounds them; no string of these values has digits.
const parse_json = (text) => JSON.parse(text.replace(/(?<=[[,:])-?\d{16,}(?=[\],}])/g, '"$&"'));

// ---- both sides

// Messages whose first bytes say big-endian: the writer has an option for it that its user does not pass on.
function big_endian(make) {
  const module = require("@foxglove/cdr/dist/CdrWriter");
  const { CdrWriter } = module;
  module.CdrWriter = class extends CdrWriter {
    constructor(options) { super({ ...options, kind: 0 }); }
  };
  try { return make(); } finally { module.CdrWriter = CdrWriter; }
}

function written_there({ version, definitions }, encoding, value) {
  if (version === "ros1") return new ros1.MessageWriter(definitions).writeMessage(value);
  const write = () => new ros2.MessageWriter(definitions).writeMessage(value);
  return encoding === "cdr" ? write() : big_endian(write);
}
function read_there({ version, definitions }, bytes) {
  const { MessageReader } = version === "ros1" ? ros1 : ros2;
  return new MessageReader(definitions).readMessage(bytes);
}

// [verb, type, encoding, message or JSON] each.
function converted_here(requests) {
  const hex = (bytes) => `x${Buffer.from(bytes).toString("hex")}`;
  const input = requests.map(([verb, { version, name, text }, encoding, from]) =>
    `${[verb, version, encoding, name, hex(text), hex(from)].join(" ")}\n`).join("");
  const program = join(dirname(process.env.ROWE_BIN), "rosmsg_convert");
  const { status, stdout, stderr } = spawnSync(program, { input, encoding: "utf8", maxBuffer: 1 << 30 });
  assert.equal(status, 0, stderr);
  const answers = stdout.trimEnd().split("\n");
  assert.equal(answers.length, requests.length);
  return answers;
}

const encodings = { ros1: ["ros1"], ros2: ["cdr", "cdr_big_endian"] };

// Compares `count` values of each type, in each encoding of its version, both ways.
function compare(types, count) {
  const cases = types.flatMap((type) => encodings[type.version].flatMap((encoding) => repeat(count, () => {
    const value = value_of(type, type.root, true, false);
    return { type, encoding, value, bytes: written_there(type, encoding, value) };
  })));
  const about = ({ type, encoding }) => `${type.name} in ${encoding}:\n${type.text}`;
  const read = converted_here(cases.map(({ type, encoding, bytes }) => ["to_json", type, encoding, bytes]));
  cases.forEach((one, n) => {
    assert.ok(!read[n].startsWith("wrong"), `${read[n]}, ${about(one)}`);
    const { type, value } = one;
    const found = plain(type, type.root, parse_json(read[n]), false);
    assert.deepEqual(found, plain(type, type.root, value, true), about(one));
  });
  const written = converted_here(cases.map(({ type, encoding, value }) =>
    ["from_json", type, encoding, json_of(type, type.root, value)]));
  cases.forEach((one, n) => assert.equal(written[n], Buffer.from(one.bytes).toString("hex"), about(one)));

  // Strings beyond ASCII, which only its readers know.
  const wide = cases.map(({ type, encoding }) =>
    ({ type, encoding, value: value_of(type, type.root, false, false) }));
  const bytes = converted_here(wide.map(({ type, encoding, value }) =>
    ["from_json", type, encoding, json_of(type, type.root, value)]));
  wide.forEach((one, n) => {
    const { type, value } = one;
    assert.ok(!bytes[n].startsWith("wrong"), `${bytes[n]}, ${about(one)}`);
    const back = read_there(type, Buffer.from(bytes[n], "hex"));
    assert.deepEqual(plain(type, type.root, back, true), plain(type, type.root, value, true), about(one));
  });
  return 2 * cases.length + wide.length;
}

test("all types of ROS 1 are the same here and there", limit, (t) => {
  const types = Object.keys(common.ros1).map((name) => type_of(name, "ros1", common_text(common.ros1, name)));
  t.diagnostic(`${types.length} types, ${compare(types, 5)} messages`);
});

test("all types of ROS 2 are the same here and there, in both byte orders", limit, (t) => {
  for (const [distribution, all] of Object.entries(common).filter(([name]) => name !== "ros1")) {
    const types = Object.keys(all).map((name) => type_of(name, "ros2", common_text(all, name)))
      .filter(is_taken);
    assert.ok(types.length > 140);
    t.diagnostic(`${distribution}: ${types.length} types, ${compare(types, 3)} messages`);
  }
});

test("random types are the same here and there", limit, (t) => {
  for (const version of ["ros1", "ros2"]) {
    const types = repeat(300, () => type_of("test/T0", version, random_text(version)));
    t.diagnostic(`${version}: ${types.length} types, ${compare(types, 5)} messages`);
  }
});

test("what is left out is the same here and there", limit, (t) => {
  const types = repeat(400, () => type_of("test/T0", "ros2", random_text("ros2"))).filter(is_taken_in_part);
  const cases = types.flatMap((type) =>
    encodings.ros2.map((encoding) => ({ type, encoding, value: value_of(type, type.root, true, true) })));
  const written = converted_here(cases.map(({ type, encoding, value }) =>
    ["from_json", type, encoding, json_of(type, type.root, value)]));
  cases.forEach(({ type, encoding, value }, n) => {
    const there = Buffer.from(written_there(type, encoding, value)).toString("hex");
    assert.equal(written[n], there, `${encoding}: ${json_of(type, type.root, value)}\n${type.text}`);
  });
  t.diagnostic(`${types.length} types, ${cases.length} messages`);
});

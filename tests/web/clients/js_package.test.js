// SPDX-License-Identifier: Apache-2.0
// The npm package of clients/js: what is in it, how large it is, and whether what it says of itself is so.
// Its types are compiled as a user's programs, and what must not compile is marked in them.
import assert from "node:assert/strict";
import { execFile } from "node:child_process";
import { cpSync, mkdirSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";
import { fileURLToPath } from "node:url";
import { promisify } from "node:util";
import { gzipSync } from "node:zlib";
import { build, transform } from "esbuild";
import typescript from "typescript";
import { connect } from "../../../clients/js/src/rowe.js";
import { rowe } from "../support/program.js";
import { robot } from "../support/robot.js";
import { watchdog_ms } from "../support/watchdog.js";

const limit = { timeout: 180000 };
const bytes_max = 6000;
const source = fileURLToPath(new URL("../../../clients/js/", import.meta.url));
const [entry, types] = ["rowe.js", "rowe.d.ts"];
const read = (name) => readFileSync(join(source, name), "utf8");
const modules = readdirSync(join(source, "src")).filter((name) => name.endsWith(".js"));
const examples = readdirSync(join(source, "examples"));

const top = mkdtempSync(join(tmpdir(), "rowe-js-"));
const project = join(top, "project");
process.on("exit", () => rmSync(top, { recursive: true, force: true }));
const quiet = ["--offline", "--no-audit", "--no-fund", "--ignore-scripts", "--no-update-notifier"];
const npm = (cwd, ...words) => promisify(execFile)("npm", [...words, ...quiet],
  { cwd, timeout: 2 * watchdog_ms, env: { ...process.env, npm_config_cache: join(top, "cache") } });

// A user's folder, in which the package is installed as npm has it.
mkdirSync(project);
writeFileSync(join(project, "package.json"), '{ "private": true, "type": "module" }');
const [packed] = JSON.parse((await npm(source, "pack", "--json", "--pack-destination", top)).stdout);
await npm(project, "install", join(top, packed.filename));
cpSync(join(source, "examples"), project, { recursive: true });

test("it has its modules, types, examples, README and licence, and nothing else", limit, async () => {
  const { stdout } = await npm(source, "pack", "--dry-run", "--json");
  const [{ files }] = JSON.parse(stdout);
  assert.deepEqual(files.map(({ path }) => path).sort(), [
    "LICENSE", "README.md", "package.json",
    ...[types, ...modules].map((name) => `src/${name}`), ...examples.map((name) => `examples/${name}`),
  ].sort());
});

test("it is what package.json says: no dependencies, rowe's version and licence", limit, () => {
  const said = JSON.parse(read("package.json"));
  const project_of = readFileSync(join(source, "../../CMakeLists.txt"), "utf8");
  const [, version] = project_of.match(/VERSION (\d+\.\d+\.\d+)/);
  assert.deepEqual([said.version, said.license, said.type, said.engines.node, said.dependencies],
    [version, "Apache-2.0", "module", ">=18", undefined]);
  const licence = readFileSync(join(source, "../../LICENSE"), "utf8");
  assert.equal(read("LICENSE"), licence);
});

test(`all of its modules together are not larger than ${bytes_max} bytes`, limit, async () => {
  const { outputFiles: [{ contents }], metafile } = await build({
    entryPoints: [join(source, "src", entry)], bundle: true, minify: true, format: "esm", target: "es2022",
    write: false, metafile: true, absWorkingDir: join(source, "src"),
  });
  assert.deepEqual(Object.keys(metafile.inputs).sort(), modules.sort(), "each is needed");
  const { length } = gzipSync(contents, { level: 9 });
  assert.ok(length <= bytes_max, `${length} bytes; ${bytes_max} fit`);
  assert.ok(length > bytes_max / 2, `${length} bytes: is that all of it?`);
});

test("once installed, offline, it is imported by its name", limit, async () => {
  const program = `import { connect, robot_error } from "rowe";
    console.log(typeof connect, robot_error.name);`;
  const { stdout } = await promisify(execFile)(process.execPath, ["--input-type=module", "-e", program],
    { cwd: project, timeout: watchdog_ms });
  assert.equal(stdout, "function robot_error\n");
});

test("without a WebSocket it says which package has one", limit, async () => {
  const program = `import { connect } from "rowe";
    delete globalThis.WebSocket;
    connect("ws://127.0.0.1:9/");`;
  const run = promisify(execFile)(process.execPath, ["--input-type=module", "-e", program],
    { cwd: project, timeout: watchdog_ms });
  await assert.rejects(run, ({ stderr }) => /robot_error: .*`npm install ws`/.test(stderr));
});

test("the example for a bundler is bundled as it says, by the package's name", limit, async () => {
  const [, words] = read("examples/bundled.js").match(/npx esbuild (.*)/);
  const esbuild = fileURLToPath(new URL("../node_modules/esbuild/bin/esbuild", import.meta.url));
  await promisify(execFile)(process.execPath, [esbuild, ...words.split(" ")],
    { cwd: project, timeout: watchdog_ms });
  assert.match(readFileSync(join(project, "stop_button.js"), "utf8"), /^("use strict";)?var stop_button=/);
});

// ---- types

// What tsc says of these files of the project; nothing if they are right.
function compiled(...files) {
  const options = {
    strict: true, noEmit: true, target: typescript.ScriptTarget.ES2022, types: [], skipLibCheck: false,
    module: typescript.ModuleKind.NodeNext, moduleResolution: typescript.ModuleResolutionKind.NodeNext,
    lib: ["lib.es2022.d.ts", "lib.dom.d.ts"], exactOptionalPropertyTypes: true,
  };
  const program = typescript.createProgram(files.map((name) => join(project, name)), options);
  return typescript.getPreEmitDiagnostics(program).map(({ messageText, file, start }) => {
    const { line } = file ? file.getLineAndCharacterOfPosition(start) : { line: -1 };
    return `${file?.fileName}:${line + 1}: ${typescript.flattenDiagnosticMessageText(messageText, "\n")}`;
  });
}
const write = (name, text) => writeFileSync(join(project, name), text);

test("the example in TypeScript compiles", limit, () => assert.deepEqual(compiled("typed.ts"), []));

test("what would be wrong of a typed robot does not compile", limit, () => {
  write("wrong.ts", `
import { connect, type robot, type drive, type subscription } from "rowe";
import type { geometry_msgs, odometry, services, topics } from "./robot.js";
const one: robot<topics, services> = connect<topics, services>("ws://127.0.0.1:8080", { name: "wrong" });
const shown: subscription<odometry> = one.subscribe("/odom", (msg, of) => {
  const x: number = msg.pose.pose.position.x + of.age_ms();
  // @ts-expect-error: there is no such member
  msg.pose.pose.place;
  return void x;
}, { hz: 10, qos: { deadline: { sec: 0, nanosec: 100000000 } } });
// @ts-expect-error: there is no such topic
one.subscribe("/odm", () => {});
// @ts-expect-error: an encoding that is none
one.subscribe("/odom", () => {}, { encoding: "png" });
// @ts-expect-error: there may be no value yet
shown.last.pose;
// @ts-expect-error: a text is no speed
one.call("/robot/set_speed", { speed: "fast" });
// @ts-expect-error: arguments are needed
one.call("/robot/set_speed");
one.call("/robot/set_speed", { speed: 1 }).then(({ speed }) => {
  const more: number = speed;
  return more;
});
const base: drive<geometry_msgs.Twist> = one.drive("/cmd_vel");
// @ts-expect-error: a command is a whole message
base.set({ linear: { x: 1, y: 0, z: 0 } });
// @ts-expect-error: who drives is the robot's word
base.held = true;
base.on("lost", ({ reason }) => {
  // @ts-expect-error: there is no such reason
  if (reason === "bored") return;
});
// @ts-expect-error: there is no such event
one.on("opened", () => {});
// @ts-expect-error: it may not be known
const stopped: boolean = one.stop.stopped;
one.stop.press({ reason: "a test" }).then(({ took_ms }) => took_ms.toFixed(1));
// @ts-expect-error: a robot comes from connect()
new robot();
void stopped;
`);
  assert.deepEqual(compiled("wrong.ts"), []);
});

test("without a robot's types each name goes", limit, () => {
  write("any.ts", `
import { connect, robot_error } from "rowe";
const one = connect();
one.subscribe("/anything", ({ data }) => console.log(data.toFixed(1)));
one.call("/any/service").then(({ values }) => values, (error) => (error as robot_error).code === "lost");
one.drive("/cmd_vel", { zero: {} }).set({ x: 1 });
one.advertise("/mine", "std_msgs/String", { latch: true }).publish({ data: "x" });
`);
  assert.deepEqual(compiled("any.ts"), []);
});

test("the types that the program prints are those that connect() takes", limit, async () => {
  const server = await robot.start();
  try {
    const { code, stdout, stderr } = await rowe("types", server.url, "--timeout", "30s");
    assert.equal(code, 0, stderr);
    write("demo.ts", stdout);
    write("uses_demo.ts", `
import { connect } from "rowe";
import type { services, topics } from "./demo.js";
const one = connect<topics, services>("${server.url}");
one.subscribe("/odom", (msg) => msg.pose.pose.position.x.toFixed(2));
one.subscribe("/rowe/stats", ({ epoch }) => epoch.length);
one.call("/rowe/stats").then(({ uptime_s }) => uptime_s.toFixed(0));
one.call("/robot/set_speed", { speed: 0.5 }).then(({ speed }) => speed.toFixed(1));
// @ts-expect-error: there is no such topic
one.subscribe("/odometry", () => {});
`);
    assert.deepEqual(compiled("uses_demo.ts"), []);
  } finally {
    await server.kill();
  }
});

test("each member that the types describe is there", limit, () => {
  const text = read(join("src", types));
  const file = typescript.createSourceFile(types, text, typescript.ScriptTarget.ES2022);
  const described = Object.fromEntries(file.statements.filter(typescript.isInterfaceDeclaration)
    .map(({ name, members }) => [name.text, members.map((each) => each.name.text)]));
  class silent_socket { close() {} }
  const one = connect("ws://127.0.0.1:9/", { WebSocket: silent_socket });
  try {
    const made = {
      robot: one, emitter: one, stop: one.stop, drive: one.drive("/cmd_vel"),
      subscription: one.subscribe("/odom", () => {}), publisher: one.advertise("/mine", "x/Y"),
    };
    for (const [name, object] of Object.entries(made)) {
      assert.ok(described[name].length > 0, name);
      for (const member of described[name]) assert.ok(member in object, `${name}.${member}`);
    }
  } finally {
    one.close();
  }
});

test("the code in the README can be read", limit, async () => {
  const blocks = [...read("README.md").matchAll(/```js\n([\s\S]*?)```/g)].map(([, code]) => code);
  assert.ok(blocks.length >= 2);
  for (const code of blocks) await transform(code, { format: "esm" });
});

// SPDX-License-Identifier: Apache-2.0
// The rounds of ./run, which says what is measured.

import { spawn } from "node:child_process";
import { once } from "node:events";
import { createRequire } from "node:module";
import { createInterface } from "node:readline";
import { parseArgs } from "node:util";
import { chromium } from "./chromium.js";
import { read } from "./reader.js";

const { WebSocket } = createRequire(new URL("../../tests/web/support/", import.meta.url))("ws");

const { values: options, positionals: [program] } = parseArgs({
  allowPositionals: true,
  options: {
    rounds: { type: "string", default: "3" },
    spend: { type: "string", default: "30,1000" },
    messages: { type: "string", default: "200" },
    throttle: { type: "string", default: "0" },
  },
});
const frame_bytes = 300;  // bench/urgent_servers.hpp
const warm_ms = 2000;
const timeout_ms = 180_000;

const sorted = (list) => [...list].sort((a, b) => a - b);
const middle = (list) => sorted(list)[list.length >> 1];
const largest = (list) => sorted(list).at(-1);

// ---- the servers and the readers

const browser = await chromium.listen();
const servers = spawn(program, [browser.origin], { stdio: ["pipe", "pipe", "inherit"] });
process.on("exit", () => servers.kill());
for (const signal of ["SIGINT", "SIGTERM"]) process.on(signal, () => process.exit(1));
const ports = {};
const answered = new Map();  // when the ping in front of an urgent message was, by that one's stamp; ms
createInterface(servers.stdout).on("line", (line) => {
  const [what, first, second] = line.split(" ");
  if (what === "pong") answered.set(first, second / 1e6);
  else ports[what] = Number(first);
});
while (!ports.default) await once(servers.stdout, "data");
browser.start();

const monotonic_ms = () => Number(process.hrtime.bigint()) / 1e6;
const readers = {
  [`ws, Node ${process.versions.node}`]: (how) =>
    read({ ...how, clock_behind_ms: monotonic_ms() - performance.now() }, WebSocket),
  [chromium.version()]: (how) => browser.read(how),
};

// ---- what it means

// How many of the `times`, which are in order, are between two moments.
function count_between(times, from, to) {
  const before = (moment) => {
    let low = 0;
    for (let high = times.length; low < high;) {
      const half = (low + high) >> 1;
      if (times[half] < moment) low = half + 1;
      else high = half;
    }
    return low;
  };
  return before(to) - before(from);
}

// What one run says, each a number for each urgent message.
function figures({ urgent, telemetry }) {
  const kib = (from, to) => (count_between(telemetry, from, to) * frame_bytes) / 1024;
  const with_pong = urgent.filter(({ stamp }) => answered.has(stamp));
  return {
    late_ms: urgent.map(({ at, handed_over }) => at - handed_over),
    kernels_kib: urgent.map(({ kernels }) => kernels / 1024),
    client_kib: urgent.map(({ at, handed_over, kernels }) => kib(handed_over, at) - kernels / 1024),
    early_ms: with_pong.map(({ at, stamp }) => at - answered.get(stamp)),
    early_kib: with_pong.map(({ at, stamp }) => kib(answered.get(stamp), at)),
    each_us: urgent.slice(-1).map(({ at }) => ((at - telemetry[0]) / telemetry.length) * 1000),
  };
}

function add(to, more) {
  for (const [name, numbers] of Object.entries(more)) (to[name] ??= []).push(...numbers);
}

// ---- the rounds

const table = [];
for (const [reader, run] of Object.entries(readers)) {
  for (const spend_us of options.spend.split(",").map(Number)) {
    table.push({ reader, run, spend_us, rowe: {}, default: {}, ratios: [] });
  }
}
let uncertain_ms = 0;
for (let round = 0; round < Number(options.rounds); ++round) {
  for (const row of table) {
    const p50 = {};
    for (const server of ["rowe", "default"]) {
      const what = `round ${round + 1}: ${row.reader}, ${row.spend_us} us, ${server}`;
      console.error(what);
      const bark = setTimeout(() => {
        console.error(`${what}: too few urgent messages within ${timeout_ms / 1000} s`);
        process.exit(1);
      }, timeout_ms);
      const said = await row.run({
        url: `ws://127.0.0.1:${ports[server]}/`, spend_us: row.spend_us, warm_ms,
        throttle_rate: Number(options.throttle), wanted: Number(options.messages),
      });
      clearTimeout(bark);
      uncertain_ms = Math.max(uncertain_ms, said.uncertain_ms ?? 0);
      const found = figures(said);
      add(row[server], found);
      p50[server] = middle(found.late_ms);
    }
    row.ratios.push(p50.default / p50.rowe);
  }
}
browser.stop();
servers.stdin.end();

// ---- the report

const columns = {
  "p50 ms": ({ late_ms }) => middle(late_ms),
  "max ms": ({ late_ms }) => largest(late_ms),
  "kernels KiB": ({ kernels_kib }) => middle(kernels_kib),
  "client KiB": ({ client_kib }) => middle(client_kib),
  "early ms": ({ early_ms }) => middle(early_ms),
  "early KiB": ({ early_kib }) => middle(early_kib),
  "us/message": ({ each_us }) => middle(each_us),
};
const three_digits = (number) => (Number.isFinite(number) ? String(Number(number.toPrecision(3))) : "-");
const line = (first, cells) => first.padEnd(26) + cells.map((cell) => cell.padStart(12)).join("");
for (const { reader, spend_us, ratios, ...of } of table) {
  console.log(`\n${line(`${reader}, ${spend_us} us`, Object.keys(columns))}`);
  for (const server of ["rowe", "default"]) {
    const numbers = Object.values(columns).map((column) => column(of[server]));
    console.log(line(server, numbers.map(three_digits)));
  }
  const each = sorted(ratios).map(three_digits).join(", ");
  console.log(`default / rowe: ${three_digits(middle(ratios))} (in the rounds: ${each})`);
}
console.log(`\nThe page's clock is known to ${three_digits(uncertain_ms)} ms.`);

// SPDX-License-Identifier: Apache-2.0
// A recording on the page of a robot, at the size of a phone, beside the robot's own stop.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { afterEach, test } from "node:test";
import { artefact, close_pages, desk, new_page } from "../support/browser.js";
import { browser, limit, server } from "../support/demo.js";
import { begin_ms, recorded, stops } from "../support/recorded.js";
import { rosbridge_client } from "../support/rosbridge.js";
import { until } from "../support/watchdog.js";

afterEach(() => close_pages(browser));

const phone = { width: 390, height: 844 };
const name = "ang-01_2026-11-30T04-09-58Z.mcap";
const whole = await recorded();

const state_is = (page, wanted) =>
  page.waitForFunction((state) => document.body.dataset.state === state, wanted);
const words = (page, id) => page.locator(`#${id}`).textContent();
const says = (page, id, pattern) =>
  page.waitForFunction(([of, wanted]) => new RegExp(wanted).test(document.getElementById(of).textContent),
    [id, pattern.source]);

async function live_page(size = phone, hash = "") {
  const page = await new_page(browser, { size });
  await page.goto(`${server.origin}/${hash}`);
  await state_is(page, "live");
  return page;
}

const file_of = (buffer) => ({ name, mimeType: "application/octet-stream", buffer });
async function recording_page({ size, hash, bytes = whole } = {}) {
  const page = await live_page(size, hash);
  await page.setInputFiles("#pick", file_of(bytes));
  await state_is(page, "recording");
  await says(page, "x", /\d/);
  return page;
}

// As a hand moves the line to a time since the begin.
const seek = (page, ms) => page.locator("#seek").evaluate((line, to) => {
  line.value = to;
  line.dispatchEvent(new Event("input"));
  line.dispatchEvent(new Event("change"));
}, ms);

test("a recording that is picked is shown, and nothing looks live", limit, async () => {
  const page = await recording_page();
  assert.equal(await words(page, "name"), name);
  assert.equal(await words(page, "state"), "RECORDING");
  await says(page, "about", /^Recorded 2026-11-30 \d\d:\d\d:\d\d \u00b7 ang-01$/);
  assert.equal(await page.title(), `\u25b7 ${name} RECORDING`);
  assert.equal(await words(page, "age"), "");
  assert.match(await words(page, "latch"), /^Robot now: /);
  assert.equal(await page.locator("#view_drive").isVisible(), false);
  await says(page, "deck_time", /^0:00\.0 \/ 1:00\.0$/);
  await says(page, "deck_says", /^2 stops, 7 messages lost$/);
  writeFileSync(artefact("recording.png"), await page.screenshot());
  assert.deepEqual(page.faults, []);
});

test("a line of time leads to each moment, and its stops", limit, async () => {
  const page = await recording_page();
  await seek(page, 30000);
  await says(page, "deck_time", /^0:30\.0 /);
  const x = 2 * Math.sin((2 * Math.PI * 30) / 24);
  await says(page, "x", new RegExp(`^${x.toFixed(3).replace("-", "\u2212")}$`));
  await says(page, "deck_says", /^2 stops, 7 messages lost$/);  // all are found
  await page.click("#next_mark");
  await says(page, "veil", /^Stopped then: Its loop robot was late or ended$/);
  await says(page, "deck_time", new RegExp(`^0:${stops[1][0] / 1000}\\.0 `));
  await page.click("#next_mark");
  await says(page, "veil", /^Stopped then: by joystick$/);
  await seek(page, 20000);
  await says(page, "veil", /^$/);
});

test("it plays at its pace, faster, and by a step", limit, async () => {
  const page = await recording_page();
  const at_s = async () => {
    const [, min, s] = (await words(page, "deck_time")).match(/^(\d+):([\d.]+) /);
    return 60 * Number(min) + Number(s);
  };
  await page.click("#play");
  await until("it plays", async () => (await at_s()) > 0.5);
  await page.selectOption("#pace", "10");
  await until("it plays faster", async () => (await at_s()) > 12);
  await page.click("#play");
  const stood = await at_s();
  await seek(page, 1000);
  await says(page, "deck_time", /^0:01\.0 /);
  assert.ok(stood > 12);
  for (let step = 0; step < 5; step += 1) {
    const before = await page.inputValue("#seek");
    await page.click("#step");
    await page.waitForFunction((value) => document.getElementById("seek").value !== value, before);
  }
  await says(page, "deck_time", /^0:01\.1 /);
  await page.click("#step_back");
  await says(page, "deck_time", /^0:01\.0 /);
});

test("it ends at its end, and begins again from there", limit, async () => {
  const page = await recording_page();
  await seek(page, 59800);
  await page.click("#play");
  await says(page, "deck_time", /^1:00\.0 /);
  await page.waitForFunction(() => document.getElementById("play").ariaLabel === "Play");
  await page.click("#play");
  await says(page, "deck_time", /^0:0\d\.\d /);
});

test("topics have their rates and values, and those of other encodings say so", limit, async () => {
  const page = await recording_page({ hash: "#view=data" });
  await seek(page, 30000);
  const row = (topic) => page.locator(`#rates [data-key='${topic}']`);
  await page.waitForFunction(() =>
    document.querySelector("#rates [data-key='/odom'] > button > :nth-child(2)")?.textContent === "50.0");
  await row("/odom").locator("> button").click();
  const shown = row("/odom").locator(".values div", { hasText: "turn_rate" }).locator("span");
  await until("a value", async () => (await shown.count()) === 1 && (await shown.textContent()) === "0.4000");
  await row("/tf").locator("> button").click();
  await until("the encoding", async () =>
    (await row("/tf").textContent()).includes("Encoding cdr: cannot be shown here"));
  assert.match(await row("/tf").textContent(), /tf2_msgs\/TFMessage \u00b7 cdr/);
  assert.equal(await words(page, "losses_say"), "One counter is not zero");
  assert.equal(await page.locator("[data-label='services']").isVisible(), false);
});

test("a plot has what came before, wherever one goes", limit, async () => {
  const page = await recording_page({ hash: "#view=plot&plot=/power:volts&span=10" });
  await seek(page, 30000);
  await says(page, "deck_time", /^0:30\.0 /);
  // Where the line is drawn, as a share of the width: from its left to its right.
  const drawn = () => page.locator("#lanes canvas").first().evaluate((canvas) => {
    const { width, height } = canvas;
    const { data } = canvas.getContext("2d").getImageData(0, 0, width, height);
    const columns = [];
    for (let x = 0; x < width; x += 1) {
      let some = false;
      for (let at = 4 * x; at < 4 * width * (height - 40); at += 4 * width) {
        some ||= data[at + 3] > 200 && data[at] > 60;
      }
      if (some) columns.push(x / width);
    }
    return [columns[0], columns.at(-1)];
  });
  await page.waitForSelector("#lanes canvas");
  await until("a line over all of it", async () => {
    const [left, right] = await drawn();
    return left < 0.25 && right > 0.9;
  });
  writeFileSync(artefact("recording_plot.png"), await page.screenshot());
});

test("STOP stops the robot itself while a recording is shown", limit, async () => {
  await server.let_run();
  const client = await rosbridge_client.connect(server.url);
  client.send({ op: "subscribe", id: "s", topic: "/rowe/stop/state" });
  const page = await recording_page();
  await says(page, "latch", /^Robot now: Running$/);
  const before = await page.locator("#stop").boundingBox();
  await page.locator("#stop").dispatchEvent("pointerdown", { button: 0 });
  await until("it is stopped", () => client.published("/rowe/stop/state").at(-1)?.state === "stopped");
  await says(page, "latch", /^Robot now: Stopped$/);
  assert.deepEqual(await page.locator("#stop").boundingBox(), before);
  client.close();
  await page.click("#back");
  await says(page, "latch", /^Stopped$/);
  await server.let_run();
});

test("back at the robot all is live again, and driving is offered", limit, async () => {
  const page = await live_page();
  await page.waitForSelector("#view_drive:not([hidden])");
  const before = await page.locator("#stop").boundingBox();
  await page.setInputFiles("#pick", file_of(whole));
  await state_is(page, "recording");
  assert.deepEqual(await page.locator("#stop").boundingBox(), before, "STOP never moves");
  await page.click("#back");
  await state_is(page, "live");
  await page.waitForSelector("#view_drive:not([hidden])");
  assert.equal(await page.locator(".deck").count(), 0);
  await says(page, "about", /^Robot clock/);
  assert.deepEqual(page.faults, []);
});

test("a file that is dropped is opened, and the page stays", limit, async () => {
  const page = await live_page(desk);
  const data = await page.evaluateHandle(([bytes, called]) => {
    const made = new DataTransfer();
    made.items.add(new File([Uint8Array.from(atob(bytes), (sign) => sign.charCodeAt())], called));
    return made;
  }, [whole.toString("base64"), name]);
  await page.dispatchEvent("body", "dragover", { dataTransfer: data });
  assert.equal(await page.locator("#drop_here").isVisible(), true);
  await page.dispatchEvent("body", "drop", { dataTransfer: data });
  await state_is(page, "recording");
  assert.equal(await page.locator("#drop_here").isVisible(), false);
  await says(page, "deck_says", /^2 stops/);
  writeFileSync(artefact("recording_desk.png"), await page.screenshot());
});

test("what was cut off is shown as far as it goes, and what is missing is said", limit, async () => {
  const page = await recording_page({ bytes: whole.subarray(0, whole.length / 2) });
  const missing = /^Its program did not come to its end; the last [\d\u202f]+ (bytes|kB) cannot be read/;
  await says(page, "deck_says", missing);
  await says(page, "deck_time", /^0:00\.0 \/ 0:[23]\d\.\d$/);
});

test("lines of JSON are shown, with their times", limit, async () => {
  const line = (n) => ({ topic: "/odom", msg: { x: n / 100, y: 2 }, time: begin_ms / 1000 + n / 10 });
  const lines = Array.from({ length: 300 }, (_, n) => JSON.stringify(line(n)));
  const page = await recording_page({ bytes: Buffer.from(lines.join("\n")) });
  await seek(page, 20000);
  await says(page, "x", /^2\.000$/);
});

test("what is no recording is refused in words, and the page stays live", limit, async () => {
  const page = await live_page();
  await page.setInputFiles("#pick", file_of(Buffer.from("\u0089PNG, say")));
  await says(page, "note", /cannot be opened: it is neither MCAP nor lines of JSON$/);
  assert.equal(await page.getAttribute("body", "data-state"), "live");
  assert.equal(await page.locator(".deck").count(), 0);
});

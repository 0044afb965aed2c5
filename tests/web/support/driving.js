// SPDX-License-Identifier: Apache-2.0
// A page that drives the demo robot, and what is seen of the robot: what it does, by its odometry, and who
// drives it, by its own word.

import { new_page } from "./browser.js";
import { rosbridge_client } from "./rosbridge.js";
import { until } from "./watchdog.js";

const again_ms = 3000;

export const is_mine = (page, mine) =>
  page.waitForFunction((wanted) => (document.body.dataset.drive === "mine") === wanted, mine);
export const line = (page, pattern) => page.waitForFunction((wanted) =>
  new RegExp(wanted).test(document.getElementById("driver_says").textContent), pattern.source);

export class driving {
  // `origin`: where pages come to the robot, if not directly.
  static async watch(browser, server, origin = server.origin) {
    const made = Object.assign(new driving(), { browser, server, origin });
    await made.look();
    return made;
  }

  // Also after a restart of the robot.
  async look() {
    this.client?.close();
    this.client = await rosbridge_client.connect(this.server.url);
    this.client.send({ op: "subscribe", topic: "/odom", throttle_rate: 20, queue_length: 1 });
    this.client.send({ op: "subscribe", topic: "/rowe/control/state" });
  }
  end() { this.client?.close(); }

  get #control() { return this.client.published("/rowe/control/state").at(-1)?.topics[0]; }
  speed() { return this.client.published("/odom").at(-1)?.twist.twist.linear.x ?? NaN; }
  stands() { return until("it stands still", () => this.speed() === 0); }
  // `again()` lets a hand go and holds it out anew, where a busy machine let its command lapse.
  moves(sign = 1, again = null) {
    let held = Date.now();
    return until("it moves", async () => {
      await this.server.let_run();
      if (this.speed() * sign > 0.1) return true;
      if (again && Date.now() - held > again_ms) {
        await again();
        held = Date.now();
      }
      return false;
    });
  }
  // A key is held, and the robot moves.
  async holds(page, key = "KeyW") {
    await page.keyboard.down(key);
    await this.moves(1, async () => {
      await page.keyboard.up(key);
      await page.keyboard.down(key);
    });
  }
  nobody() { return until("nobody drives", () => this.#control?.driver === null); }

  async page_of(options) {
    const page = await new_page(this.browser, options);
    await page.goto(`${this.origin}/#view=drive`);
    await page.waitForFunction(() => document.body.dataset.state === "live");
    await page.locator("#take").waitFor({ state: "visible" });
    return page;
  }

  // Of a robot that stands still: the first command ends the figure that it drives by itself.
  async driving_page(options = {}) {
    const page = await this.page_of(options);
    await until("it runs", async () => {
      await this.server.let_run();
      return (await page.getAttribute("body", "data-stop")) === "running";
    });
    await page.click("#take");
    await is_mine(page, true);
    await until("a command counts", async () => {
      await page.keyboard.press("KeyW", { delay: 120 });
      return this.#control.age_ms !== null;
    });
    await this.stands();
    return page;
  }
}

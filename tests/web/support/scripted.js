// SPDX-License-Identifier: Apache-2.0
// An endpoint that says exactly what a test wants: the program serves the page, but the page's socket ends in
// the test. So states can be tried that a healthy demo robot never shows.

import { new_page } from "./browser.js";

export const stats_of = (topics, more = {}) => ({
  name: "scripted", uptime_s: 1, peers: 1, real_time: { fifo: true, pinned: true, locked: true }, losses: {},
  topics: topics.map(([topic, type, bytes = 100]) => ({
    topic, type, bytes, messages: 10, rate_hz: 10, gap_ms_max: 100, subscribers: 1,
  })),
  ...more,
});

export class scripted_page {
  // `messages` maps topics to what is published on them 20 times a second while the page subscribes to them,
  // or to what makes it; `services` maps services to what makes their answers.
  static async open(browser, origin, messages, { hash = "", services = {}, ...options } = {}) {
    const made = new scripted_page();
    Object.assign(made, { messages, services });
    made.asked = [];        // on all connections,
    made.connections = [];  // and on each
    made.timers = [];
    made.page = await new_page(browser, options);
    await made.page.routeWebSocket(/.*/, (socket) => made.#serve(socket));
    await made.page.goto(`${origin}/${hash}`);
    return made;
  }

  #serve(socket) {
    const wanted = new Map();  // the topics subscribed to, by the id of the subscription
    const asked = [];
    const say = (message) => socket.send(JSON.stringify(message));
    this.connections.push({ asked, wanted, end: () => socket.close() });
    socket.onClose(() => wanted.clear());
    socket.onMessage((text) => {
      const message = JSON.parse(text);
      this.asked.push(message);
      asked.push(message);
      if (message.op === "subscribe") wanted.set(message.id, message.topic);
      if (message.topic === "/rowe/stats") this.say = say;  // the first connection
      if (message.op === "unsubscribe") wanted.delete(message.id);
      if (message.op === "call_service") {
        const { id, service, args } = message;
        const answers = this.services[service];
        const values = answers ? answers(args) : `Service ${service} does not exist`;
        say({ op: "service_response", id, service, values, result: Boolean(answers) });
      }
    });
    this.timers.push(setInterval(() => {
      for (const topic of new Set(wanted.values())) {
        const said = this.messages[topic];
        const msg = typeof said === "function" ? said() : said;
        if (msg !== undefined) say({ op: "publish", topic, msg });
      }
    }, 50).unref());  // a test that fails before close() must end all the same
  }

  // The topics that the page subscribes to now.
  get wanted() { return this.connections.flatMap(({ wanted }) => [...wanted.values()]); }

  text(id) {
    return this.page.locator(`#${id}`).textContent();
  }

  // Resolves when the element `id` says `words`.
  says(id, words) {
    const said = ([of, wanted]) => document.getElementById(of).textContent === wanted;
    return this.page.waitForFunction(said, [id, words]);
  }

  async close() {
    this.timers.forEach(clearInterval);
    await this.page.context().close();
  }
}

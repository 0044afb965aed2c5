// SPDX-License-Identifier: Apache-2.0
// The view of data, all of it. What it shows is asked for while it is seen.

import { moment, since_ms } from "../../clients/js/src/link.js";
import { black_box } from "./black_box.js";
import { element } from "./dom.js";
import { health_view } from "./health_view.js";
import { ask_types, parameters_view, services_view } from "./settings_view.js";
import { topics_view } from "./topics_view.js";

const peers_ms = 1000;
const lists_ms = 10000;  // names come and go seldom

export class data_view {
  #robot;
  #visible = false;
  #asked_peers = null;
  #asked_lists = null;

  constructor(robot, feeds, plots, rights) {
    this.#robot = robot;
    this.topics = new topics_view(feeds, plots);
    this.parameters = new parameters_view(robot, rights);
    this.services = new services_view(robot, rights);
    this.black_box = new black_box(robot, rights);
    this.health = new health_view();
    robot.on("open", () => (this.#asked_lists = this.#asked_peers = null));
  }

  // A recording answers no questions.
  asks = () => true;

  visible(visible) {
    this.#visible = visible;
    this.topics.visible(visible);
  }

  rights_changed() {
    this.parameters.show();
    this.services.show();
    this.black_box.show();
    this.#asked_lists = null;  // whoever may call it asks whether there is one
  }

  // `at` is the endpoint's time in seconds.
  show(stats, at) {
    this.topics.show(stats.topics, at, stats.topics_left_out);
    this.health.show(stats, at);
  }

  turn() {
    if (!this.#visible || document.hidden || this.#robot.state !== "open" || !this.asks()) return;
    if (!this.#asked_lists || since_ms(this.#asked_lists) > lists_ms) {
      this.#asked_lists = moment();
      this.#ask_lists();
    }
    if (!this.#asked_peers || since_ms(this.#asked_peers) > peers_ms) {
      this.#asked_peers = moment();
      this.#ask_peers();
    }
  }

  async #ask_lists() {
    const types = await ask_types(this.#robot).catch(() => null);  // a role without the right: plain forms
    this.parameters.ask(types);
    this.services.ask(types);
    this.black_box.ask();
  }

  async #ask_peers() {
    const section = element("peers").closest("section");
    try {
      const answer = await this.#robot.call("/rowe/stats");
      section.hidden = !Array.isArray(answer?.connections);
      this.health.show_answer(answer ?? {});
    } catch ({ code }) {
      if (code === "refused") section.hidden = true;
    }
  }
}

// SPDX-License-Identifier: Apache-2.0
// Opens a recording: the worker that reads it, the player that the page shows it by, and the deck. A script
// by itself, which the page loads when somebody opens the first one.

import { deck } from "./recording/deck.js";
import { player } from "./recording/player.js";
import { words } from "./recording/words.js";

class asked {
  #worker;
  #waiting = new Map();
  #ids = 0;

  constructor(told) {
    this.#worker = new Worker(new URL("recording_worker.js", import.meta.url));
    this.#worker.onmessage = ({ data }) => (data.id ? this.#answered(data) : told(data));
    this.#worker.onerror = ({ message }) => this.#fail(message || "the worker ended");
    this.told = told;
  }

  ask(what, question) {
    return new Promise((done, failed) => {
      this.#waiting.set((this.#ids += 1), { done, failed });
      this.#worker.postMessage({ id: this.#ids, what, ...question });
    });
  }

  #answered({ id, value, failed, damage }) {
    const waiting = this.#waiting.get(id);
    this.#waiting.delete(id);
    if (damage) this.told({ damage });
    if (failed) waiting.failed(new Error(failed));
    else waiting.done(value);
  }

  #fail(why) {
    for (const { failed } of this.#waiting.values()) failed(new Error(why));
    this.#waiting.clear();
  }

  end() { this.#worker.terminate(); }
}

export class recording {
  #asked;
  #deck;
  #last = null;
  #ended = false;

  // `back()`: somebody wants the robot again.
  constructor(file, back) {
    this.name = file.name;
    this.#deck = new deck(back);
    this.#asked = new asked((what) => this.#told(what));
    this.opened = this.#open(file);
  }

  // Resolves with the source; a recording that cannot be opened is an Error with words.
  async #open(file) {
    const facts = await this.#asked.ask("open", { file });
    this.source = new player((what, question) => this.#asked.ask(what, question), facts, words.cannot_show);
    this.source.changed = () => this.#deck.show();
    this.#deck.begin(this.source);
    requestAnimationFrame((now) => this.#turn(now));
    return this.source;
  }

  #told({ progress, stops, losses, damage }) {
    if (progress !== undefined) this.#deck.progress(progress);
    if (stops) this.#deck.stops(stops);
    if (losses) this.#deck.losses(losses);
    if (damage) this.#deck.damage(damage);
    this.#deck.show();
  }

  #turn(now) {
    if (this.#ended) return;
    requestAnimationFrame((next) => this.#turn(next));
    this.source.turn(now - (this.#last ?? now));
    this.#last = now;
    if (this.source.playing) this.#deck.show();
  }

  // What the robot is called in it; empty: it does not say.
  get robot() {
    const { rowe } = this.source.facts.metadata;
    return rowe?.name ?? rowe?.robot ?? "";
  }
  // In words, why the robot stood still then; empty: it ran.
  get stopped() {
    const told = this.source.stop_state;
    return told?.state === "stopped" ? words.stopped(told) : "";
  }

  end() {
    this.#ended = true;
    this.#asked.end();
    this.#deck.end();
  }
}

// SPDX-License-Identifier: Apache-2.0
// A recording as a source of what the page shows (feeds.js). It stands at a time of the recording, and goes
// on from there as fast as somebody wants. What a frame needs is asked of the worker at once, for one stretch
// of time; while it has not answered the time stands still, so nothing is passed over.

import { moment, since_ms } from "../../../clients/js/src/link.js";

const hz_usual = 30;
const step_ms_max = 250;       // of real time that one frame makes up for
const list_ms = 500;           // from list to list of topics
const past_points = 1500;      // of each topic, of what came before
const past_parts = { fine: 96, rough: 10 };
const stats_topic = "/rowe/stats";
const stop_topic = "/rowe/stop/state";

// What the robot told of itself, as far as it has the shape that is shown.
function told_of(stats) {
  if (stats === null || typeof stats !== "object") return { unknown: true };
  const { name, losses, loops, cycle_us_max, real_time } = stats;
  const counted = Object.entries(losses ?? {}).filter(([, count]) => typeof count === "number");
  const listed = (Array.isArray(loops) ? loops : []).filter((one) => one !== null && typeof one === "object");
  return { name, losses: Object.fromEntries(counted), loops: listed, cycle_us_max, real_time };
}

const parsed = (text) => {
  try {
    return JSON.parse(text);
  } catch {
    return undefined;
  }
};

class subscription {
  #player;
  at_ms = null;

  constructor(player, topic, fn, options) {
    this.#player = player;
    Object.assign(this, { topic, fn, options });
  }

  get refused() { return this.#player.why_not(this.topic); }
  age_ms() { return this.at_ms === null ? Infinity : Math.max(0, this.#player.now_ms - this.at_ms); }
  // By the time of who looks: played faster, it is older for as long.
  fresh(ms_max = 1000) { return this.age_ms() < ms_max * Math.max(1, this.#player.speed); }

  take(msg, at_ms) {
    this.at_ms = at_ms;
    try {
      this.fn(msg);
    } catch (error) {
      queueMicrotask(() => { throw error; });
    }
  }

  unsubscribe() { this.#player.forget(this); }
}

export class player {
  #ask;
  #all = new Set();
  #fresh = new Set();    // subscribed to, and not looked for yet
  #shown = new Map();    // topic → what is known of it
  #busy = false;
  #due_ms = 0;           // of real time, not played yet
  #listed = null;        // when the topics were listed last
  #aim = null;           // {to_ms, rough} where to go as soon as it can be
  #drops = false;        // what is asked for now need not be answered if somebody goes elsewhere
  fault = null;          // why it goes no further
  knows_past = true;
  playing = false;
  speed = 1;
  stop_state = null;     // what the robot told of its stop then
  unreadable = 0;        // messages that are no JSON
  changed = () => {};

  // ask(what, question) → what the worker answers; `facts` as it tells them; why_not(one of its topics):
  // words for what cannot be shown.
  constructor(ask, facts, why_not) {
    this.#ask = ask;
    this.facts = facts;
    this.now_ms = facts.begin_ms;
    for (const one of facts.topics) {
      this.#shown.set(one.topic, { shown: one.shown, why_not: one.shown ? null : why_not(one) });
    }
  }

  clock_ms(at_ms) { return at_ms; }
  get ended() { return this.now_ms >= this.facts.end_ms; }
  why_not(topic) { return this.#shown.get(topic)?.why_not ?? null; }

  subscribe(topic, fn, options) {
    const made = new subscription(this, topic, fn, options);
    this.#all.add(made);
    this.#fresh.add(made);
    return made;
  }
  forget(one) {
    this.#all.delete(one);
    this.#fresh.delete(one);
  }

  play(playing) {
    if (playing && this.ended) this.seek(this.facts.begin_ms);
    this.playing = playing;
    this.#due_ms = 0;
    this.changed();
  }

  // `rough`: the hand is still on it.
  seek(to_ms, rough = false) {
    const { begin_ms, end_ms } = this.facts;
    this.#aim = { to_ms: Math.min(end_ms, Math.max(begin_ms, to_ms)), rough };
    if (this.#drops) this.#ask("drop", {}).catch(() => {});
    this.#drops = false;
  }
  get aim_ms() { return this.#aim?.to_ms ?? this.now_ms; }

  // To the next message, or back to the one before.
  async step(forward) {
    this.playing = false;
    const at_ms = await this.#ask(forward ? "next" : "before", { at_ms: this.aim_ms });
    if (at_ms !== null) this.seek(at_ms);
    this.changed();
  }

  // Once a frame, with the real time since the one before.
  turn(passed_ms) {
    this.#due_ms = this.playing ? Math.min(step_ms_max, this.#due_ms + passed_ms) : 0;
    if (this.#busy) return;
    if (this.#aim) this.#run(() => this.#go());
    else if (this.#fresh.size > 0) this.#run(() => this.#look_for_fresh());
    else if (this.playing && this.#due_ms > 0) this.#run(() => this.#go_on());
    else if (this.#list_is_old) this.#run(() => this.#list());
  }

  get #list_is_old() { return this.#listed === null || since_ms(this.#listed) > list_ms; }

  async #run(act) {
    this.#busy = true;
    try {
      await act();
      this.fault = null;
    } catch (error) {
      this.fault = error.message;
      this.playing = false;
    }
    this.#busy = this.#drops = false;
    this.changed();
  }

  #topics(of = this.#all) {
    const known = [...of].filter(({ options }) => !options.listing).map(({ topic }) => topic);
    return [...new Set(known)].filter((topic) => this.#shown.get(topic)?.shown);
  }

  async #go_on() {
    const from_ms = this.now_ms;
    const to_ms = Math.min(this.facts.end_ms, from_ms + this.#due_ms * this.speed);
    this.#due_ms = 0;
    const periods = new Map([[stop_topic, 0]]);
    for (const { topic, options } of this.#all) {
      const period_ms = (1000 / (options.hz ?? hz_usual)) * this.speed;
      periods.set(topic, Math.min(period_ms, periods.get(topic) ?? Infinity));
    }
    const topics = [...new Set([...this.#topics(), stop_topic])];
    const wanted = topics.map((topic) => [topic, periods.get(topic)]);
    const found = await this.#ask("span", { wanted, from_ms, to_ms });
    if (this.#aim) return;  // somebody has gone elsewhere meanwhile
    this.now_ms = to_ms;
    for (const one of found ?? []) this.#give(one, this.#all);
    if (this.ended) this.playing = false;
    if (this.#list_is_old) await this.#list();
  }

  async #go() {
    const aim = this.#aim;
    if (!await this.#show([...this.#all], aim.to_ms, aim)) return;
    if (!aim.rough) await this.#list();
  }

  async #look_for_fresh() {
    const some = [...this.#fresh];
    this.#fresh.clear();
    await this.#show(some, this.now_ms, null);
    await this.#list();
  }

  // What holds at a time, and then what came before, which takes longer. False: somebody has gone elsewhere
  // meanwhile.
  async #show(some, at_ms, aim) {
    const topics = [...new Set([...this.#topics(some), stop_topic])];
    const last = await this.#ask("look", { topics, at_ms });
    if (this.#aim !== aim) return false;
    this.#aim = null;
    if (aim) {
      [this.now_ms, this.stop_state] = [at_ms, null];
      for (const one of some) this.#fresh.delete(one);
    }
    this.#replace(some, [], last);
    this.changed();
    const looking_back = some.filter(({ options }) => options.past_ms);
    const past = await this.#past(looking_back, at_ms, aim?.rough ? past_parts.rough : past_parts.fine);
    if (!past || this.#aim) return false;
    this.#replace(looking_back, past, last);
    return true;
  }

  // [{past_ms, messages}] of what came before a time; null: somebody has gone elsewhere.
  async #past(some, at_ms, parts_max) {
    const found = [];
    this.#drops = true;
    for (const past_ms of new Set(some.map(({ options }) => options.past_ms))) {
      const topics = this.#topics(some.filter(({ options }) => options.past_ms === past_ms));
      const wanted = topics.map((topic) => [topic, Math.max(past_ms / past_points, 1000 / hz_usual)]);
      if (wanted.length === 0) continue;
      const from_ms = at_ms - past_ms;
      const messages = await this.#ask("past", { wanted, from_ms, to_ms: at_ms, parts_max });
      if (!messages) return null;
      found.push({ past_ms, messages });
    }
    this.#drops = false;
    return found;
  }

  // What was shown before does not lead to this.
  #replace(some, past, last) {
    for (const one of some) {
      one.at_ms = null;
      one.options.jumped?.();
    }
    for (const { past_ms, messages } of past) {
      const those = some.filter(({ options }) => options.past_ms === past_ms);
      for (const one of messages) this.#give(one, those);
    }
    for (const one of last) {
      this.#give(one, some.filter(({ at_ms }) => at_ms === null || at_ms < one.time_ms));
    }
  }

  #give({ topic, text, time_ms }, to) {
    const msg = parsed(text);
    if (msg === undefined) return (this.unreadable += 1);
    if (topic === stop_topic) this.stop_state = msg;
    const takes = (one) => one.topic === topic && !one.options.listing && this.#all.has(one);
    for (const one of to) if (takes(one)) one.take(msg, time_ms);
  }

  // The topics with their rates now, and what the robot told of itself, as /rowe/stats has it.
  async #list() {
    this.#listed = moment();
    const at_ms = this.now_ms;
    const [rates, [told]] = [await this.#ask("rates", { at_ms }),
      await this.#ask("look", { topics: [stats_topic], at_ms })];
    const of = new Map((rates ?? []).map((each) => [each.topic, each]));
    const topics = this.facts.topics.map(({ topic, type, encoding, shown, messages }) => ({
      topic, type: shown ? type : [type, encoding].filter(Boolean).join(" \u00b7 "), counted: true, messages,
      rate_hz: of.get(topic)?.rate_hz ?? NaN, gap_ms_max: of.get(topic)?.gap_ms ?? NaN,
      bytes: of.get(topic)?.bytes ?? 0,
    }));
    const own = told_of(told ? parsed(told.text) : null);
    const listing = { ...own, topics, uptime_s: (at_ms - this.facts.begin_ms) / 1000 };
    for (const one of this.#all) if (one.options.listing) one.take(listing, at_ms);
  }
}

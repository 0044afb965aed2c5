// SPDX-License-Identifier: Apache-2.0
// Questions to a recording: what is the latest message of each topic at a time, what comes between two times,
// how often does each topic say something then. Each answer unpacks a bounded number of parts.

import { damage, text_of } from "./bytes.js";
import { lay_out } from "./layout.js";
import { parts } from "./parts.js";

const look_parts_max = 96;       // for the latest message of each topic
const span_parts_max = 64;       // for what comes between two times
const learn_parts_max = 64;      // to know which topics there are, where nothing says so
const step_parts_max = 256;      // for the message before or behind a time
const rate_parts_max = 32;
const rate_ms = 2000;            // over which a rate is counted
const answer_bytes_max = 32 << 20;
const message_bytes_least = 256;  // as which a short one counts
const message_bytes_max = 4 << 20;  // what is longer would keep the page from all else while it is read
const shown_encodings = ["json", "jsonschema"];

// The first index at which `is_behind(index)` holds, of indices below `count` where it holds from one on.
export function first_where(count, is_behind) {
  let [low, high] = [0, count];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (is_behind(middle)) high = middle;
    else low = middle + 1;
  }
  return low;
}

const may_have = ({ channels }, id) => !channels || channels.includes(id);

// Parts by their begins, with the latest end of those up to each.
class ordered {
  constructor(all) {
    this.parts = all;
    let latest = -Infinity;
    this.ends = Float64Array.from(all, ({ end_ms }) => (latest = Math.max(latest, end_ms)));
  }

  // How many begin at or before a time.
  begun(time_ms) { return first_where(this.parts.length, (at) => this.parts[at].begin_ms > time_ms); }
  // Those that may have messages after `from_ms`, and up to `to_ms`.
  between(from_ms, to_ms) {
    const first = first_where(this.parts.length, (at) => this.ends[at] > from_ms);
    return this.parts.slice(first, this.begun(to_ms)).filter(({ end_ms }) => end_ms > from_ms);
  }
}

export class reading {
  #of_channel = new Map();  // channel → ordered
  #topics = new Map();      // topic → {channels, encoding, type, count}

  // `file` as File; a recording that cannot be read ends in `damage`.
  static async open(file, progress, bytes_max) {
    const [layout, bytes] = await lay_out(file, progress);
    const made = new reading();
    Object.assign(made, { layout, parts: new parts(bytes, layout, bytes_max) });
    layout.parts.sort((one, other) => one.begin_ms - other.begin_ms || one.at - other.at);
    if (layout.parts.length === 0) {
      throw new damage(layout.damaged.length > 0 ? "no message in it can be read" : "it has no messages");
    }
    made.all = new ordered(layout.parts);
    [made.begin_ms, made.end_ms] = [layout.begin_ms, layout.end_ms];
    await made.#learn();
    made.#sort();
    return made;
  }

  // Channels that only a chunk describes: those that the parts name are looked for there, the others in the
  // first parts.
  async #learn() {
    const { channels, counts } = this.layout;
    if (counts?.size > 0) return;  // all that have messages are described
    let left = learn_parts_max;
    const asked = new Set();
    for (const part of this.layout.parts) {
      if (left === 0) return;
      const unknown = part.channels?.filter((id) => !channels.has(id) && !asked.has(id));
      if (part.channels ? unknown.length === 0 : channels.size > 0 && left < learn_parts_max / 2) continue;
      left -= 1;
      await this.parts.get(part);
      unknown?.forEach((id) => asked.add(id));
    }
  }

  // By topic and by channel.
  #sort() {
    const lists = new Map();
    const everywhere = [];
    for (const part of this.layout.parts) {
      for (const id of part.channels ?? []) {
        if (!lists.has(id)) lists.set(id, []);
        lists.get(id).push(part);
      }
      if (!part.channels) everywhere.push(part);
    }
    // Where a part does not say what is in it, every channel may be: one list does for all of them.
    const shared = everywhere.length > 0 ? this.all : null;
    for (const id of this.layout.channels.keys()) {
      this.#of_channel.set(id, shared ?? new ordered(lists.get(id) ?? []));
    }
    for (const [id, { topic, encoding, schema }] of this.layout.channels) {
      if (!this.#topics.has(topic)) {
        const type = this.layout.schemas.get(schema)?.name ?? "";
        const messages = this.layout.counts ? 0 : null;
        this.#topics.set(topic, { topic, type, encoding, channels: [], messages });
      }
      const of = this.#topics.get(topic);
      of.channels.push(id);
      if (of.messages !== null) of.messages += this.layout.counts.get(id) ?? 0;
    }
  }

  // {topic, type, encoding, messages: how many, or null; shown: its messages are JSON} of each.
  get topics() {
    return [...this.#topics.values()].map(({ channels, ...of }) =>
      ({ ...of, shown: shown_encodings.includes(of.encoding) }));
  }
  channels_of(topic) { return this.#topics.get(topic)?.channels ?? []; }
  parts_of(topic) {
    return this.channels_of(topic).flatMap((id) =>
      this.#of_channel.get(id).parts.filter((part) => may_have(part, id)));
  }

  // What is too long to be shown is counted once.
  #is_short({ lengths, at }, index) {
    if (lengths[index] <= message_bytes_max) return true;
    this.#too_long.add(at[index]);
    return false;
  }
  get too_long() { return this.#too_long.size; }
  #too_long = new Set();

  static #message(listed, index, topic) {
    const at = listed.at[index];
    const bytes = listed.lengths[index];
    const text = text_of(listed.plain.subarray(at, at + bytes));
    return { topic, time_ms: listed.times[index], text, bytes };
  }

  // The latest message of a channel at or before a time; `budget.parts` go down with each part that had to be
  // unpacked.
  async #latest(id, time_ms, budget) {
    const { parts: list, ends } = this.#of_channel.get(id);
    let best = null;
    for (let at = this.#of_channel.get(id).begun(time_ms) - 1; at >= 0; at -= 1) {
      if (best && best.time_ms > Math.min(ends[at], time_ms)) break;
      if (!may_have(list[at], id)) continue;
      if (!this.parts.has(list[at]) && (budget.parts -= 1) < 0) break;
      const listed = await this.parts.get(list[at]);
      const places = listed?.of.get(id);
      if (!places) continue;
      const behind = first_where(places.length, (index) => listed.times[places[index]] > time_ms);
      if (behind === 0) continue;
      const found = listed.times[places[behind - 1]];
      // Of equal times the later one in the file.
      if (!best || found > best.time_ms || (found === best.time_ms && list[at].at > best.part.at)) {
        best = { time_ms: found, listed, index: places[behind - 1], part: list[at] };
      }
    }
    return best;
  }

  // The latest message of each of these topics, at or before a time.
  async look(topics, time_ms) {
    const budget = { parts: look_parts_max };
    const found = [];
    let bytes = 0;
    for (const topic of topics) {
      if (bytes > answer_bytes_max) break;
      let best = null;
      for (const id of this.channels_of(topic)) {
        const one = await this.#latest(id, time_ms, budget);
        if (one && (!best || one.time_ms > best.time_ms)) best = one;
      }
      if (!best || !this.#is_short(best.listed, best.index)) continue;
      found.push(reading.#message(best.listed, best.index, topic));
      bytes += found.at(-1).bytes + message_bytes_least;
    }
    return found;
  }

  // The messages of topics after `from_ms` and up to `to_ms`, by their times: of each topic the last one in
  // each of its periods, `wanted` being [topic, period_ms]. Of many parts only some are looked into, as far
  // apart as can be. `goes_on()` false: nobody wants to know any more.
  async span(wanted, from_ms, to_ms, { parts_max = span_parts_max, goes_on = () => true } = {}) {
    const of = new Map(wanted.flatMap(([topic, period_ms]) =>
      this.channels_of(topic).map((id) => [id, { topic, period_ms: Math.max(period_ms, 0.001) }])));
    const all = this.all.between(from_ms, to_ms)
      .filter(({ channels }) => !channels || channels.some((id) => of.has(id)));
    const chosen = new Map();  // topic and period → the message
    let bytes = 0;
    const step = Math.max(1, all.length / parts_max);
    for (let each = 0; each < all.length && bytes < answer_bytes_max; each += step) {
      if (!await goes_on()) return null;
      const part = all[Math.min(all.length - 1, Math.floor(each))];
      const listed = await this.parts.get(part);
      for (const [id, { topic, period_ms }] of listed ? of : []) {
        for (const index of reading.#last_of_periods(listed, id, from_ms, to_ms, period_ms)) {
          if (bytes >= answer_bytes_max) break;
          if (!this.#is_short(listed, index)) continue;
          const key = `${Math.floor(listed.times[index] / period_ms)} ${topic}`;
          const before = chosen.get(key);
          if (before && before.time_ms > listed.times[index]) continue;
          const made = reading.#message(listed, index, topic);
          bytes += made.bytes - (before ? before.bytes : -message_bytes_least);
          chosen.set(key, made);
        }
      }
    }
    return [...chosen.values()].sort((one, other) => one.time_ms - other.time_ms);
  }

  // The places of a channel's messages after `from_ms` up to `to_ms`: the last one of each period.
  static #last_of_periods({ times, of }, id, from_ms, to_ms, period_ms) {
    const places = of.get(id);
    if (!places) return [];
    const found = [];
    const period = (at) => Math.floor(times[places[at]] / period_ms);
    let at = first_where(places.length, (each) => times[places[each]] > from_ms);
    const end = first_where(places.length, (each) => times[places[each]] > to_ms);
    for (; at < end; at += 1) if (at + 1 === end || period(at + 1) !== period(at)) found.push(places[at]);
    return found;
  }

  // How often each topic says something up to a time, over two seconds: {rate_hz, gap_ms, bytes} by topic.
  async rates(time_ms) {
    const from_ms = time_ms - rate_ms;
    const all = this.all.between(from_ms, time_ms);
    if (all.length > rate_parts_max) return null;
    const counted = new Map();
    for (const part of all) {
      const listed = await this.parts.get(part);
      if (!listed) continue;
      listed.times.forEach((at, index) => {
        if (at <= from_ms || at > time_ms) return;
        const id = listed.channels[index];
        if (!counted.has(id)) counted.set(id, { count: 0, last: at, gap_ms: 0, bytes: 0 });
        const one = counted.get(id);
        one.count += 1;
        one.gap_ms = Math.max(one.gap_ms, at - one.last);
        [one.last, one.bytes] = [Math.max(one.last, at), listed.lengths[index]];
      });
    }
    const over_s = Math.max(Math.min(rate_ms, time_ms - this.begin_ms), 1) / 1000;
    return [...this.#topics.values()].map(({ topic, channels }) => {
      const own = channels.map((id) => counted.get(id)).filter(Boolean);
      const count = own.reduce((sum, each) => sum + each.count, 0);
      const gap_ms = count > 1 ? Math.max(...own.map((each) => each.gap_ms)) : NaN;
      return { topic, rate_hz: count / over_s, gap_ms, bytes: own[0]?.bytes ?? 0 };
    });
  }

  // The time of the next message after a time, or of the last one before it; null: there is none.
  async next(time_ms) {
    const first = first_where(this.all.parts.length, (at) => this.all.ends[at] > time_ms);
    const end = Math.min(this.all.parts.length, first + step_parts_max);
    let best = Infinity;
    for (let at = first; at < end && this.all.parts[at].begin_ms < best; at += 1) {
      const listed = await this.parts.get(this.all.parts[at]);
      for (const each of listed?.times ?? []) if (each > time_ms && each < best) best = each;
    }
    return best === Infinity ? null : best;
  }
  async before(time_ms) {
    const begun = this.all.begun(time_ms);
    const end = Math.max(0, begun - step_parts_max);
    let best = -Infinity;
    for (let at = begun - 1; at >= end && this.all.ends[at] > best; at -= 1) {
      const listed = await this.parts.get(this.all.parts[at]);
      for (const each of listed?.times ?? []) if (each < time_ms && each > best) best = each;
    }
    return best === -Infinity ? null : best;
  }

  // The part behind a time, so that it is at hand when it is wanted.
  async prepare(time_ms) {
    const next = this.all.parts[this.all.begun(time_ms)];
    if (next) await this.parts.get(next);
  }
}

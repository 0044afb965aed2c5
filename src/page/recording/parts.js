// SPDX-License-Identifier: Apache-2.0
// The parts of a recording, unpacked when somebody wants them, and kept while there is room.

import { damage } from "./bytes.js";
import { list_lines } from "./lines.js";
import { list_messages, unpack_chunk } from "./records.js";

const kept_bytes_max = 96 << 20;
const message_bytes = 24;  // beside its text, in the lists

// The messages of one channel in a part, by their times: places in the lists.
function places_of(listed) {
  const of = new Map();
  listed.channels.forEach((channel, index) => {
    if (!of.has(channel)) of.set(channel, []);
    of.get(channel).push(index);
  });
  const { times } = listed;
  for (const [channel, places] of of) {
    const in_order = places.every((place, at) => at === 0 || times[places[at - 1]] <= times[place]);
    if (!in_order) places.sort((one, other) => times[one] - times[other] || one - other);
    of.set(channel, Uint32Array.from(places));
  }
  return of;
}

export class parts {
  #file;
  #layout;
  #kept = new Map();  // part → listed, or a promise of it; the one that was used last stands last
  #ids = new Map();   // of topics, in lines of JSON
  bytes = 0;
  unpacked = 0;       // how many, so far

  // `layout` as layout.js; `bytes_max`: what is kept, beside the part that was asked for last.
  constructor(file, layout, bytes_max = kept_bytes_max) {
    this.#file = file;
    this.#layout = layout;
    this.bytes_max = bytes_max;
    for (const [id, { topic }] of layout.channels) this.#ids.set(topic, id);
  }

  has(part) { return part.damaged === true || this.#kept.get(part)?.of !== undefined; }

  // {plain, times, channels, at, lengths, of}; null: it cannot be read, and is counted from now on.
  async get(part) {
    if (part.damaged) return null;
    let listed = this.#kept.get(part);
    this.#kept.delete(part);
    listed ??= this.#load(part).catch((error) => this.#miss(part, error));
    this.#kept.set(part, listed);
    if (!(listed instanceof Promise)) return listed;
    const loaded = await listed;
    // Two may have waited for it.
    if (this.#kept.get(part) === listed) {
      this.#kept.delete(part);
      if (loaded) this.#keep(part, loaded);
    }
    return loaded;
  }

  #keep(part, loaded) {
    this.#kept.set(part, loaded);
    this.bytes += loaded.bytes;
    for (const [other, listed] of this.#kept) {
      if (this.bytes <= this.bytes_max || other === part) break;
      if (listed instanceof Promise) continue;
      this.#kept.delete(other);
      this.bytes -= listed.bytes;
    }
  }

  #miss(part, error) {
    part.damaged = true;
    const why = error instanceof damage ? error.message : String(error);
    this.#layout.damaged.push({ at: part.at, bytes: part.bytes, why });
    return null;
  }

  async #load(part) {
    const bytes = await this.#file.read(part.at, part.bytes);
    this.unpacked += 1;
    const listed = part.kind === "lines" ? list_lines(bytes, part, (topic) => this.#ids.get(topic))
      : list_messages(part.kind === "chunk" ? unpack_chunk(bytes) : bytes,
        (schema) => this.#layout.add_schema(schema), (channel) => this.#layout.add_channel(channel));
    listed.of = places_of(listed);
    listed.bytes = listed.plain.length + listed.times.length * message_bytes;
    return listed;
  }
}

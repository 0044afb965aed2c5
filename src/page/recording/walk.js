// SPDX-License-Identifier: Apache-2.0
// Looks through a file of MCAP that lacks its end, from head to head: of chunks it reads what stands in front
// of their bytes. Behind what is damaged it goes on with the next chunk, if one begins within some megabytes.

import { reader } from "./bytes.js";
import {
  chunk_head_bytes, has_magic, head_bytes, magic, op, packed_bytes_max, plain_bytes_max, read_channel,
  read_chunk_head, read_metadata, read_schema,
} from "./records.js";

const described_bytes_max = 16 << 20;  // of a schema or a channel
const metadata_bytes_max = 1 << 20;
const loose_bytes = 1 << 20;           // messages in no chunk are taken together up to this
const search_bytes_max = 64 << 20;
const search_step = 1 << 20;
const progress_bytes = 16 << 20;

async function near(file, at, count) {
  if (!file.holds(at, count)) await file.move(at, count);
  return file.near(at, count);
}

// The part that a chunk is, from the first bytes of its content; null: it cannot be one.
function part_of(from, at, content_bytes) {
  try {
    const { begin_ms, end_ms, plain_bytes, compression, packed_bytes } = read_chunk_head(from);
    const head = 8 + 8 + 8 + 4 + 4 + compression.length + 8;
    if (head + packed_bytes !== content_bytes || begin_ms > end_ms || compression.length > 4) return null;
    const bytes = head_bytes + content_bytes;
    return { kind: "chunk", at, bytes, begin_ms, end_ms, channels: null, plain_bytes };
  } catch {
    return null;
  }
}

class walker {
  #file;
  #into;
  #loose = null;  // the part that messages outside of chunks go to
  #chunk = null;  // the chunk whose message indexes may follow

  constructor(file, into) {
    this.#file = file;
    this.#into = into;
  }

  // Takes a record; false: it is damaged.
  async take(what, at, bytes) {
    const content = at + head_bytes;
    if (what === op.message) return this.#take_message(at, bytes);
    if (what !== op.schema && what !== op.channel) this.#loose = null;
    if (what === op.chunk) return this.#take_chunk(at, bytes);
    if (what === op.message_index) return bytes < 6 || this.#take_index(content);
    if (what !== op.schema && what !== op.channel && what !== op.metadata) return true;
    if (what === op.metadata && bytes > metadata_bytes_max) return true;  // it is left out
    if (bytes > described_bytes_max) return false;
    const from = new reader(await this.#file.read(content, bytes));
    if (what === op.schema) this.#into.add_schema(read_schema(from));
    else if (what === op.channel) this.#into.add_channel(read_channel(from));
    else this.#into.add_metadata(read_metadata(from));
    return true;
  }

  async #take_chunk(at, bytes) {
    const head = await near(this.#file, at + head_bytes, Math.min(bytes, chunk_head_bytes));
    const part = part_of(head, at, bytes);
    if (!part) return false;
    this.#chunk = part;
    if (part.plain_bytes === 0) return true;
    if (part.plain_bytes <= plain_bytes_max && part.bytes <= packed_bytes_max) this.#into.parts.push(part);
    else this.#into.damaged.push({ at, bytes: part.bytes, why: "a chunk is too large" });
    return true;
  }

  async #take_index(content) {
    const from = await near(this.#file, content, 6);
    const [channel, bytes] = [from.u16(), from.u32()];
    if (this.#chunk && bytes > 0 && this.#into.has_room(1)) (this.#chunk.channels ??= []).push(channel);
    return true;
  }

  async #take_message(at, bytes) {
    if (bytes < 22) return false;
    this.#chunk = null;
    const from = await near(this.#file, at + head_bytes, 22);
    const channel = from.u16();
    from.skip(4);
    const time_ms = from.time_ms();
    const whole = head_bytes + bytes;
    if (whole > plain_bytes_max) {
      this.#into.damaged.push({ at, bytes: whole, why: "a message is too large" });
      this.#loose = null;
      return true;
    }
    if (!this.#loose || at + whole - this.#loose.at > loose_bytes) {
      this.#loose = { kind: "loose", at, bytes: 0, begin_ms: time_ms, end_ms: time_ms, channels: [],
        seen: new Set(), plain_bytes: 0 };
      this.#into.parts.push(this.#loose);
    }
    const part = this.#loose;
    part.bytes = part.plain_bytes = at + whole - part.at;
    part.begin_ms = Math.min(part.begin_ms, time_ms);
    part.end_ms = Math.max(part.end_ms, time_ms);
    if (!part.seen.has(channel) && this.#into.has_room(1)) {
      part.seen.add(channel);
      part.channels.push(channel);
    }
    return true;
  }
}

// Where the next chunk begins, from `at` on; null: not near.
async function find_chunk(file, at) {
  const end = Math.min(file.size, at + search_bytes_max);
  for (let begin = at; begin < end; begin += search_step) {
    const want = search_step + head_bytes + chunk_head_bytes;
    const bytes = await file.read(begin, Math.min(want, file.size - begin));
    const last = Math.min(search_step, bytes.length - head_bytes - chunk_head_bytes);
    for (let each = 0; each < last; each += 1) {
      if (bytes[each] !== op.chunk || bytes[each + 7] !== 0 || bytes[each + 8] !== 0) continue;
      const from = new reader(bytes, each + 1, each + head_bytes + chunk_head_bytes);
      const length = from.u64();
      const fits = length <= file.size - begin - each - head_bytes;
      if (fits && part_of(from, begin + each, length)) return begin + each;
    }
  }
  return null;
}

// The record that begins at `at`: [what, bytes]; null: the file is cut off or damaged there.
async function head_of(file, at) {
  if (file.size - at < head_bytes) return null;
  const from = await near(file, at, head_bytes);
  const what = from.u8();
  if (what === 0) return null;
  const bytes = from.bytes[from.at + 7] || from.bytes[from.at + 6] > 15 ? Infinity : from.u64();
  return bytes <= file.size - at - head_bytes ? [what, bytes] : null;
}

// Fills `into`, as layout.
export async function walk(file, into, progress) {
  const by = new walker(file, into);
  let at = magic.length;
  let told = 0;
  into.ended = false;
  while (at < file.size) {
    if (at - told > progress_bytes) progress((told = at) / file.size);
    if (!into.has_room(0)) return into.damaged.push({ at, bytes: file.size - at, why: "cut" });
    const head = await head_of(file, at);
    if (head?.[0] === op.data_end || head?.[0] === op.footer) {
      into.ended = has_magic(await file.read(file.size - magic.length, magic.length));
      return;
    }
    if (head && await by.take(head[0], at, head[1]).catch(() => false)) {
      at += head_bytes + head[1];
      continue;
    }
    const next = await find_chunk(file, at + 1);
    const more = into.add_damage({ at, bytes: (next ?? file.size) - at,
      why: next === null ? "cut" : "damaged" });
    if (next === null) return;
    if (!more) return into.damaged.push({ at: next, bytes: file.size - next, why: "cut" });
    at = next;
  }
}

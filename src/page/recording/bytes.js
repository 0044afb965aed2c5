// SPDX-License-Identifier: Apache-2.0
// Reading numbers and texts out of bytes that anybody may have written: each length is checked against what
// is there, and what does not fit ends in `damage`.

export class damage extends Error {}

export function check(holds, words) {
  if (!holds) throw new damage(words);
}

const utf8 = new TextDecoder();
export const text_of = (bytes) => utf8.decode(bytes);

// Nanoseconds since 1970 as milliseconds, to a quarter of a microsecond in our times; whole ones are exact.
// 2^32 is 4294 million and 967296.
const ms_of = (low, high) => high * 4294 + (high * 967296 + low) / 1e6;

export class reader {
  #view;

  constructor(bytes, at = 0, end = bytes.length) {
    Object.assign(this, { bytes, at, end });
    this.#view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  }

  get left() { return this.end - this.at; }

  #pass(count) {
    check(count <= this.end - this.at, "a record ends too early");
    const { at } = this;
    this.at += count;
    return at;
  }

  u8() { return this.#view.getUint8(this.#pass(1)); }
  u16() { return this.#view.getUint16(this.#pass(2), true); }
  u32() { return this.#view.getUint32(this.#pass(4), true); }

  // A length or an offset: what no file reaches is damage.
  u64() {
    const at = this.#pass(8);
    const value = this.#view.getUint32(at + 4, true) * 4294967296 + this.#view.getUint32(at, true);
    check(Number.isSafeInteger(value), "a length is larger than any file");
    return value;
  }

  time_ms() {
    const at = this.#pass(8);
    return ms_of(this.#view.getUint32(at, true), this.#view.getUint32(at + 4, true));
  }

  take(count) {
    const at = this.#pass(count);
    return this.bytes.subarray(at, at + count);
  }
  skip(count) { this.#pass(count); }
  text() { return text_of(this.take(this.u32())); }

  // A list of so many bytes, each item read by `read_one(this)`.
  list(read_one) {
    const bytes = this.u32();
    check(bytes <= this.left, "a list ends too early");
    const inside = new reader(this.bytes, this.at, this.at + bytes);
    this.at += bytes;
    const items = [];
    while (inside.left > 0) items.push(read_one(inside));
    return items;
  }

  map() { return new Map(this.list((from) => [from.text(), from.text()])); }
}

const crc_table = Uint32Array.from({ length: 256 }, (_, byte) => {
  let crc = byte;
  for (let bit = 0; bit < 8; bit += 1) crc = crc & 1 ? (crc >>> 1) ^ 0xedb88320 : crc >>> 1;
  return crc;
});

// CRC-32 as in zlib, of `bytes` behind those that gave `before`.
export function crc32(bytes, before = 0) {
  let crc = ~before;
  for (let at = 0; at < bytes.length; at += 1) crc = (crc >>> 8) ^ crc_table[(crc ^ bytes[at]) & 255];
  return ~crc >>> 0;
}

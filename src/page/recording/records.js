// SPDX-License-Identifier: Apache-2.0
// What the records of MCAP say (https://mcap.dev/spec). Times are milliseconds since 1970.

import { check, crc32, reader } from "./bytes.js";
import { unpack_lz4 } from "./lz4.js";
import { unpack_zstd } from "./zstd.js";

export const magic = Uint8Array.of(0x89, 0x4d, 0x43, 0x41, 0x50, 0x30, 0x0d, 0x0a);
export const has_magic = (bytes) => magic.every((byte, at) => bytes[at] === byte);

export const op = {
  header: 1, footer: 2, schema: 3, channel: 4, message: 5, chunk: 6, message_index: 7, chunk_index: 8,
  attachment_index: 10, statistics: 11, metadata: 12, metadata_index: 13, data_end: 15,
};
export const head_bytes = 9;               // an opcode, and how many bytes follow
export const footer_bytes = 20;
export const chunk_head_bytes = 8 + 8 + 8 + 4 + 4 + 4 + 8;  // the longest that is known: "zstd"
const message_head_bytes = 2 + 4 + 8 + 8;
export const plain_bytes_max = 64 << 20;   // of a chunk: a larger one is not unpacked
export const packed_bytes_max = plain_bytes_max + (1 << 20);

const compressions = {
  "": (bytes, plain_bytes) => {
    check(bytes.length === plain_bytes, "a chunk is not as long as it was said to be");
    return bytes;
  },
  lz4: unpack_lz4,
  zstd: unpack_zstd,
};

// {what, at, end} of each record in bytes[at, end).
export function* records_in(bytes, at = 0, end = bytes.length) {
  const from = new reader(bytes, at, end);
  while (from.left > 0) {
    const what = from.u8();
    const length = from.u64();
    from.skip(length);
    yield { what, at: from.at - length, end: from.at };
  }
}

export function read_schema(from) {
  const id = from.u16();
  return { id, name: from.text(), encoding: from.text() };
}

export function read_channel(from) {
  const [id, schema] = [from.u16(), from.u16()];
  return { id, schema, topic: from.text(), encoding: from.text() };
}

export const read_metadata = (from) => ({ name: from.text(), values: from.map() });

// A part of the file, as chunks are for who reads: {kind, at, bytes, begin_ms, end_ms, channels,
// plain_bytes}. `channels`: those that have messages there; null: not known.
export function read_chunk_index(from) {
  const [begin_ms, end_ms, at, bytes] = [from.time_ms(), from.time_ms(), from.u64(), from.u64()];
  const channels = from.list((item) => {
    const id = item.u16();
    item.u64();
    return id;
  });
  const index_bytes = from.u64();
  from.text();
  from.u64();
  const plain_bytes = from.u64();
  const known = channels.length > 0 ? channels : null;
  return { kind: "chunk", at, bytes, begin_ms, end_ms, channels: known, plain_bytes, index_bytes };
}

export function read_statistics(from) {
  const messages = from.u64();
  from.skip(2 + 4);
  const [attachments, metadata, chunks] = [from.u32(), from.u32(), from.u32()];
  const [begin_ms, end_ms] = [from.time_ms(), from.time_ms()];
  const counts = new Map(from.list((item) => [item.u16(), item.u64()]));
  return { messages, attachments, metadata, chunks, begin_ms, end_ms, counts };
}

// What stands in front of a chunk's bytes.
export function read_chunk_head(from) {
  const [begin_ms, end_ms, plain_bytes, crc] = [from.time_ms(), from.time_ms(), from.u64(), from.u32()];
  const compression = from.text();
  return { begin_ms, end_ms, plain_bytes, crc, compression, packed_bytes: from.u64() };
}

// The plain records of a chunk, from its whole record.
export function unpack_chunk(record) {
  const from = new reader(record);
  const is_chunk = from.u8() === op.chunk && from.u64() === record.length - head_bytes;
  check(is_chunk, "there is no chunk where one was");
  const { plain_bytes, crc, compression, packed_bytes } = read_chunk_head(from);
  check(plain_bytes <= plain_bytes_max, "a chunk is too large");
  check(Object.hasOwn(compressions, compression), "a compression that is not known");
  const plain = compressions[compression](from.take(packed_bytes), plain_bytes);
  check(crc === 0 || crc === crc32(plain), "a chunk is not what was written");
  return plain;
}

// The messages in plain records: {plain, times, channels, at, lengths}, one item each; what describes
// channels goes to `on_schema` and `on_channel`.
export function list_messages(plain, on_schema, on_channel) {
  let count = 0;
  for (const { what } of records_in(plain)) count += what === op.message ? 1 : 0;
  const listed = {
    plain, times: new Float64Array(count), channels: new Uint16Array(count), at: new Uint32Array(count),
    lengths: new Uint32Array(count),
  };
  let index = 0;
  for (const { what, at, end } of records_in(plain)) {
    if (what === op.schema) on_schema(read_schema(new reader(plain, at, end)));
    if (what === op.channel) on_channel(read_channel(new reader(plain, at, end)));
    if (what !== op.message) continue;
    const from = new reader(plain, at, end);
    listed.channels[index] = from.u16();
    from.skip(4);
    listed.times[index] = from.time_ms();
    listed.at[index] = at + message_head_bytes;
    check(end - at >= message_head_bytes, "a message ends too early");
    listed.lengths[index] = end - at - message_head_bytes;
    index += 1;
  }
  return listed;
}

// SPDX-License-Identifier: Apache-2.0
// Unpacks LZ4 frames (lz4_Frame_format.md of LZ4), whose blocks may depend on each other. Checksums are
// passed over: a chunk of a recording has one of its own. What comes out never gets longer than it was said
// to be.

import { check, damage, reader } from "./bytes.js";

const frame_magic = 0x184d2204;
const skippable_magic = 0x184d2a50;  // … to 0x184d2a5f
const match_least = 4;

// A length whose four bits were all set goes on in bytes: [how much more, where they end].
function more_of(input, at, end, most) {
  let length = 0;
  let byte;
  do {
    check(at < end && length <= most, "a length of LZ4 has no end");
    byte = input[at];
    at += 1;
    length += byte;
  } while (byte === 255);
  return [length, at];
}

// A few bytes are copied faster one by one.
const few = 32;

export function copy(input, at, count, output, out) {
  if (count > few) return output.set(input.subarray(at, at + count), out);
  for (let each = 0; each < count; each += 1) output[out + each] = input[at + each];
}

// Copies what stands `offset` before `out`; the two may overlap, and repeat then.
export function copy_match(output, out, offset, length) {
  if (offset >= length && length > few) output.copyWithin(out, out - offset, out - offset + length);
  else if (offset === 1) output.fill(output[out - 1], out, out + length);
  else for (let at = out; at < out + length; at += 1) output[at] = output[at - offset];
}

// One block, input[at, end), to output[out …); nothing before `least` may be repeated. Returns where the
// output ends.
function unpack_block(input, at, end, output, out, least) {
  for (;;) {
    check(at < end, "a block of LZ4 ends too early");
    const token = input[at];
    at += 1;
    let literals = token >> 4;
    if (literals === 15) {
      const [more, behind] = more_of(input, at, end, output.length);
      literals += more;
      at = behind;
    }
    check(literals <= end - at && literals <= output.length - out, "literals of LZ4 are too long");
    copy(input, at, literals, output, out);
    at += literals;
    out += literals;
    if (at === end) return out;  // the last one has literals alone
    check(at + 2 <= end, "a block of LZ4 ends too early");
    const offset = input[at] | (input[at + 1] << 8);
    at += 2;
    check(offset > 0 && offset <= out - least, "LZ4 repeats what is not there");
    let length = token & 15;
    if (length === 15) {
      const [more, behind] = more_of(input, at, end, output.length);
      length += more;
      at = behind;
    }
    length += match_least;
    check(length <= output.length - out, "a chunk is longer than it was said to be");
    copy_match(output, out, offset, length);
    out += length;
  }
}

// The head of a frame, behind its magic.
function frame_head(from) {
  const flags = from.u8();
  check(flags >> 6 === 1, "a version of LZ4 that is not known");
  from.u8();
  if (flags & 8) from.skip(8);  // the size of its content
  if (flags & 1) throw new damage("LZ4 with a dictionary cannot be read here");
  from.u8();
  return { alone: (flags & 32) !== 0, block_sums: (flags & 16) !== 0, sum: (flags & 4) !== 0 };
}

function unpack_frame(from, output, out) {
  const { alone, block_sums, sum } = frame_head(from);
  const begin = out;
  for (;;) {
    const head = from.u32();
    if (head === 0) break;
    const block = from.take(head & 0x7fffffff);
    if (block_sums) from.skip(4);
    if (head >>> 31) {
      check(block.length <= output.length - out, "a chunk is longer than it was said to be");
      output.set(block, out);
      out += block.length;
    } else {
      out = unpack_block(block, 0, block.length, output, out, alone ? out : begin);
    }
  }
  if (sum) from.skip(4);
  return out;
}

// All frames of `input`, which are `plain_bytes` unpacked, neither more nor less.
export function unpack_lz4(input, plain_bytes) {
  const output = new Uint8Array(plain_bytes);
  const from = new reader(input);
  let out = 0;
  while (from.left > 0) {
    const magic = from.u32();
    if (((magic & 0xfffffff0) >>> 0) === skippable_magic) {
      from.skip(from.u32());
      continue;
    }
    check(magic === frame_magic, "this is no frame of LZ4");
    out = unpack_frame(from, output, out);
  }
  check(out === plain_bytes, "a chunk is shorter than it was said to be");
  return output;
}

// SPDX-License-Identifier: Apache-2.0
// Unpacks Zstandard (RFC 8878). The window is what was unpacked before, so it needs no memory of its own.
// Checksums are passed over: a chunk of a recording has one of its own. What comes out never gets longer than
// it was said to be.

import { check, damage, reader } from "./bytes.js";
import { copy, copy_match } from "./lz4.js";
import {
  backward_bits, fse_of_one, fse_table, read_fse, read_huffman, read_literals,
} from "./zstd_tables.js";

const frame_magic = 0xfd2fb528;
const skippable_magic = 0x184d2a50;  // … to 0x184d2a5f
const block_bytes_max = 1 << 17;
const no_room = "a chunk is longer than it was said to be";

// Of lengths and offsets, as RFC 8878, 3.1.1.3.2.1 has them: what a code stands for, and how many bits more.
const grow = (bits, from) => {
  let base = from;
  return bits.map((count) => {
    const at = base;
    base += 2 ** count;
    return at;
  });
};
const long_bits = [7, 8, 9, 10, 11, 12, 13, 14, 15, 16];
const literal_bits = [...Array(16).fill(0), 1, 1, 1, 1, 2, 2, 3, 3, 4, 6, ...long_bits];
const match_bits = [...Array(32).fill(0), 1, 1, 1, 1, 2, 2, 3, 3, 4, 4, 5, ...long_bits];
const literal_bases = grow(literal_bits, 0);
const match_bases = grow(match_bits, 3);
const offset_code_max = 31;

const usual_tables = () => ({
  literals: fse_table([4, 3, ...Array(11).fill(2), 1, 1, 1, ...Array(9).fill(2), 3, 2, ...Array(5).fill(1),
    ...Array(4).fill(-1)], 6),
  offsets: fse_table([...Array(6).fill(1), 2, 2, 2, ...Array(15).fill(1), ...Array(5).fill(-1)], 5),
  matches: fse_table([1, 4, 3, ...Array(6).fill(2), ...Array(37).fill(1), ...Array(7).fill(-1)], 6),
});
let usual = null;

// In the order in which a block has them: the name, and the largest table and code.
const kinds = [["literals", 9, 35], ["offsets", 8, offset_code_max], ["matches", 9, 52]];

class frame {
  #output;
  #begin;
  #out;
  #huffman = null;
  #tables = {};
  #repeated = [1, 4, 8];
  #literals = new Uint8Array(block_bytes_max);

  constructor(output, out) {
    this.#output = output;
    this.#begin = this.#out = out;
  }

  get out() { return this.#out; }

  #room(count) { check(count <= this.#output.length - this.#out, no_room); }

  raw(bytes) {
    this.#room(bytes.length);
    this.#output.set(bytes, this.#out);
    this.#out += bytes.length;
  }

  repeated(byte, count) {
    this.#room(count);
    this.#output.fill(byte, this.#out, this.#out + count);
    this.#out += count;
  }

  packed(block) {
    const [count, at] = this.#read_literals(block);
    this.#run_sequences(block, at, count);
  }

  // How many literals there are, and where the sequences begin.
  #read_literals(block) {
    check(block.length > 0, "a block of Zstandard is empty");
    const kind = block[0] & 3;
    const form = (block[0] >> 2) & 3;
    const from = new reader(block);
    if (kind < 2) {
      const head = form === 1 ? from.u16() >> 4
        : form === 3 ? (from.u16() | (from.u8() << 16)) >> 4 : from.u8() >> 3;
      check(head <= block_bytes_max, "literals of Zstandard are too long");
      if (kind === 0) this.#literals.set(from.take(head));
      else this.#literals.fill(from.u8(), 0, head);
      return [head, from.at];
    }
    return this.#read_packed_literals(block, from, kind === 3, form);
  }

  #read_packed_literals(block, from, treeless, form) {
    const width = [10, 10, 14, 18][form];
    const low = from.u16();
    const high = form < 2 ? from.u8() : form === 2 ? from.u16() : from.u16() | (from.u8() << 16);
    const all = high * 65536 + low;  // up to 40 bits
    const count = Math.floor(all / 16) % 2 ** width;
    const bytes = Math.floor(all / 2 ** (4 + width)) % 2 ** width;
    check(count <= block_bytes_max && bytes <= from.left, "literals of Zstandard are too long");
    const end = from.at + bytes;
    let begin = from.at;
    if (!treeless) [this.#huffman, begin] = read_huffman(block, from.at, end);
    check(this.#huffman, "literals of Zstandard have no tree");
    if (form === 0) read_literals(this.#huffman, block, begin, end, this.#literals, 0, count);
    else this.#read_four_streams(block, begin, end, count);
    return [count, end];
  }

  #read_four_streams(block, begin, end, count) {
    check(end - begin >= 10, "literals of Zstandard end too early");
    const share = (count + 3) >> 2;
    check(3 * share <= count, "literals of Zstandard are too few");
    let at = begin + 6;
    for (let stream = 0; stream < 4; stream += 1) {
      const head = begin + 2 * stream;
      const behind = stream === 3 ? end : at + (block[head] | (block[head + 1] << 8));
      check(behind <= end, "literals of Zstandard end too early");
      const of = stream === 3 ? count - 3 * share : share;
      read_literals(this.#huffman, block, at, behind, this.#literals, stream * share, of);
      at = behind;
    }
  }

  // The tables of a block's sequences. Where they end.
  #read_tables(block, at) {
    check(at < block.length, "sequences of Zstandard have no tables");
    const modes = block[at];
    check((modes & 3) === 0, "sequences of Zstandard in a form that is not known");
    let next = at + 1;
    kinds.forEach(([name, log_max, code_max], index) => {
      const mode = (modes >> (6 - 2 * index)) & 3;
      if (mode === 0) {
        this.#tables[name] = (usual ??= usual_tables())[name];
      } else if (mode === 1) {
        check(next < block.length && block[next] <= code_max, "a code of Zstandard is not known");
        this.#tables[name] = fse_of_one(block[next]);
        next += 1;
      } else if (mode === 2) {
        [this.#tables[name], next] = read_fse(block, next, block.length, log_max, code_max);
      }
      check(this.#tables[name], "a table of Zstandard is missing");
    });
    return next;
  }

  #run_sequences(block, begin, literals) {
    const from = new reader(block, begin);
    let sequences = from.u8();
    if (sequences === 255) sequences = from.u16() + 0x7f00;
    else if (sequences > 127) sequences = ((sequences - 128) << 8) + from.u8();
    if (sequences === 0) {
      check(from.left === 0, "a block of Zstandard goes on too long");
      return this.raw(this.#literals.subarray(0, literals));
    }
    const bits_at = this.#read_tables(block, from.at);
    const bits = new backward_bits(block, bits_at, block.length);
    const used = this.#run(bits, sequences, literals);
    check(bits.left === 0, "sequences of Zstandard do not end with their bits");
    this.raw(this.#literals.subarray(used, literals));
  }

  // How many literals they used.
  #run(bits, sequences, literals) {
    const { literals: l, offsets: o, matches: m } = this.#tables;
    const limit = this.#out + block_bytes_max;
    let l_state = bits.read(l.log);
    let o_state = bits.read(o.log);
    let m_state = bits.read(m.log);
    let used = 0;
    for (let left = sequences; left > 0; left -= 1) {
      const offset_code = o.symbols[o_state];
      const value = 2 ** offset_code + bits.read(offset_code);
      const m_code = m.symbols[m_state];
      const length = match_bases[m_code] + bits.read(match_bits[m_code]);
      const l_code = l.symbols[l_state];
      const count = literal_bases[l_code] + bits.read(literal_bits[l_code]);
      check(count <= literals - used, "sequences of Zstandard want more literals than there are");
      this.#room(count);
      copy(this.#literals, used, count, this.#output, this.#out);
      this.#out += count;
      used += count;
      this.#repeat(this.#offset(value, count), length);
      check(this.#out <= limit, "a block of Zstandard is too long");
      if (left === 1) break;
      l_state = l.bases[l_state] + bits.read(l.bits[l_state]);
      m_state = m.bases[m_state] + bits.read(m.bits[m_state]);
      o_state = o.bases[o_state] + bits.read(o.bits[o_state]);
      check(bits.left >= 0, "sequences of Zstandard end too early");
    }
    return used;
  }

  // The offset that a value stands for: one of the last three, or another one.
  #offset(value, literals) {
    const last = this.#repeated;
    const which = value > 3 ? 3 : value - 1 + (literals === 0 ? 1 : 0);
    if (which === 0) return last[0];
    const offset = value > 3 ? value - 3 : which === 3 ? last[0] - 1 : last[which];
    check(offset > 0, "an offset of Zstandard is zero");
    this.#repeated = which === 1 ? [offset, last[0], last[2]] : [offset, last[0], last[1]];
    return offset;
  }

  #repeat(offset, length) {
    check(offset <= this.#out - this.#begin, "Zstandard repeats what is not there");
    this.#room(length);
    copy_match(this.#output, this.#out, offset, length);
    this.#out += length;
  }
}

// The head of a frame, behind its magic. Whether a checksum follows the frame.
function skip_frame_head(from) {
  const flags = from.u8();
  const [single, dictionary] = [(flags & 32) !== 0, flags & 3];
  check((flags & 8) === 0, "a form of Zstandard that is not known");
  if (!single) from.skip(1);
  const number = from.take([0, 1, 2, 4][dictionary]);
  if (number.some((byte) => byte !== 0)) throw new damage("Zstandard with a dictionary cannot be read here");
  from.skip([single ? 1 : 0, 2, 4, 8][flags >> 6]);
  return (flags & 4) !== 0;
}

// A small block may take as long as a large one, so there are only so many of them.
function unpack_frame(from, output, out, blocks_left) {
  const has_sum = skip_frame_head(from);
  const made = new frame(output, out);
  let last = false;
  while (!last) {
    check((blocks_left.count -= 1) >= 0, "Zstandard in too many blocks");
    const head = from.u16() | (from.u8() << 16);
    last = (head & 1) !== 0;
    const [kind, bytes] = [(head >> 1) & 3, head >> 3];
    check(bytes <= block_bytes_max && kind !== 3, "a block of Zstandard in a form that is not known");
    if (kind === 0) made.raw(from.take(bytes));
    else if (kind === 1) made.repeated(from.u8(), bytes);
    else made.packed(from.take(bytes));
  }
  if (has_sum) from.skip(4);
  return made.out;
}

// All frames of `input`, which are `plain_bytes` unpacked, neither more nor less.
export function unpack_zstd(input, plain_bytes) {
  const output = new Uint8Array(plain_bytes);
  const from = new reader(input);
  const blocks_left = { count: 1024 + plain_bytes / 128 };
  let out = 0;
  while (from.left > 0) {
    const magic = from.u32();
    if (((magic & 0xfffffff0) >>> 0) === skippable_magic) {
      from.skip(from.u32());
      continue;
    }
    check(magic === frame_magic, "this is no frame of Zstandard");
    out = unpack_frame(from, output, out, blocks_left);
  }
  check(out === plain_bytes, "a chunk is shorter than it was said to be");
  return output;
}

// SPDX-License-Identifier: Apache-2.0
// The tables of Zstandard (RFC 8878, chapter 4): bits that are read from their end, FSE tables, Huffman
// trees.

import { check } from "./bytes.js";

// Bits of input[begin, end), read backwards from the highest bit that is set, which only marks the end.
export class backward_bits {
  constructor(input, begin, end) {
    check(end > begin && input[end - 1] !== 0, "bits of Zstandard have no end");
    this.input = input;
    this.first = begin * 8;
    this.at = end * 8 - 8 + (31 - Math.clz32(input[end - 1]));
  }

  get left() { return this.at - this.first; }

  // The next `count` bits, at most 31. In front of the first one stand zeros; `left` is negative then.
  read(count) {
    if (count > 16) return this.read(count - 16) * 65536 + this.read(16);
    this.at -= count;
    return this.peek_at(this.at, count);
  }

  // `count` bits, at most 16, from bit `at` on.
  peek_at(at, count) {
    const { input, first } = this;
    if (at < first) {
      const short = first - at;
      return short >= count ? 0 : this.peek_at(first, count - short) << short;
    }
    const byte = at >> 3;
    const word = input[byte] | (input[byte + 1] << 8) | (input[byte + 2] << 16);
    return (word >> (at & 7)) & ((1 << count) - 1);
  }
}

// An FSE table from how often each symbol comes (-1: less than once), for states of `log` bits. `symbols`,
// `bits` and `bases` by state: what a state says, how many bits it reads, and what they are added to.
export function fse_table(counts, log) {
  const size = 1 << log;
  const [symbols, bits, bases] = [new Uint8Array(size), new Uint8Array(size), new Uint16Array(size)];
  const next = new Uint16Array(counts.length);
  let high = size;
  counts.forEach((count, symbol) => {
    if (count === -1) symbols[high -= 1] = symbol;
    next[symbol] = Math.abs(count);
  });
  const step = (size >> 1) + (size >> 3) + 3;
  let place = 0;
  counts.forEach((count, symbol) => {
    for (let each = 0; each < count; each += 1) {
      symbols[place] = symbol;
      do place = (place + step) & (size - 1); while (place >= high);
    }
  });
  check(place === 0, "a table of Zstandard is not whole");
  for (let state = 0; state < size; state += 1) {
    const of = next[symbols[state]];
    next[symbols[state]] += 1;
    bits[state] = log - (31 - Math.clz32(of));
    bases[state] = (of << bits[state]) - size;
  }
  return { symbols, bits, bases, log };
}

// One symbol always: its state reads no bits.
export const fse_of_one = (symbol) =>
  ({ symbols: Uint8Array.of(symbol), bits: new Uint8Array(1), bases: new Uint16Array(1), log: 0 });

// How often each symbol comes, as input[at, end) says it; [table, where it ends].
export function read_fse(input, at, end, log_max, symbols_max) {
  let bit = at * 8;
  const last = end * 8;
  const peek = (count) => {
    const byte = bit >> 3;
    const word = input[byte] | (input[byte + 1] << 8) | (input[byte + 2] << 16);
    return (word >> (bit & 7)) & ((1 << count) - 1);
  };
  const log = peek(4) + 5;
  bit += 4;
  check(log <= log_max, "a table of Zstandard is too large");
  const counts = [];
  let left = (1 << log) + 1;
  while (left > 1 && counts.length <= symbols_max) {
    const width = 32 - Math.clz32(left);
    const low = (1 << width) - 1 - left;  // so many values are written by a bit less
    const short = peek(width - 1);
    let value = short;
    if (short < low) {
      bit += width - 1;
    } else {
      value = peek(width);
      if (value >= 1 << (width - 1)) value -= low;
      bit += width;
    }
    const count = value - 1;
    left -= Math.abs(count);
    counts.push(count);
    check(bit <= last, "a table of Zstandard ends too early");
    for (let more = count === 0 ? 3 : 0; more === 3;) {
      more = peek(2);
      bit += 2;
      for (let each = 0; each < more; each += 1) counts.push(0);
      check(bit <= last && counts.length <= symbols_max + 1, "a table of Zstandard is too long");
    }
  }
  check(left === 1 && counts.length <= symbols_max + 1, "a table of Zstandard does not add up");
  return [fse_table(counts, log), (bit + 7) >> 3];
}

const huffman_bits_max = 11;
const weights_max = 255;

// Weights of a Huffman tree, packed by FSE: two states in turn, until the bits are used up.
function read_packed_weights(input, at, end) {
  const [table, bits_at] = read_fse(input, at, end, 6, 12);
  const bits = new backward_bits(input, bits_at, end);
  const states = [bits.read(table.log), bits.read(table.log)];
  check(bits.left >= 0, "weights of Zstandard end too early");
  const weights = [];
  for (let turn = 0; weights.length < weights_max; turn ^= 1) {
    const state = states[turn];
    weights.push(table.symbols[state]);
    const count = table.bits[state];
    if (bits.left < count) {
      weights.push(table.symbols[states[turn ^ 1]]);
      return weights;
    }
    states[turn] = table.bases[state] + bits.read(count);
  }
  check(false, "Zstandard has too many weights");
}

function read_weights(input, at, end) {
  check(at < end, "a tree of Zstandard is missing");
  const head = input[at];
  const begin = at + 1;
  const behind = begin + (head < 128 ? head : (head - 126) >> 1);
  check(behind <= end, "a tree of Zstandard ends too early");
  if (head < 128) return [read_packed_weights(input, begin, behind), behind];
  const weights = Array.from({ length: head - 127 }, (_, index) =>
    (index & 1 ? input[begin + (index >> 1)] & 15 : input[begin + (index >> 1)] >> 4));
  return [weights, behind];
}

// A Huffman table: by the next `log` bits, the symbol, and how many of them it takes. [table, where it ends].
export function read_huffman(input, at, end) {
  const [weights, behind] = read_weights(input, at, end);
  check(weights.length <= weights_max, "Zstandard has too many weights");
  let total = 0;
  for (const weight of weights) if (weight > 0) total += 2 ** (weight - 1);
  check(total > 0, "a tree of Zstandard is empty");
  const log = 32 - Math.clz32(total);
  check(log <= huffman_bits_max, "a tree of Zstandard is too deep");
  const rest = 2 ** log - total;
  check((rest & (rest - 1)) === 0, "a tree of Zstandard does not add up");
  weights.push(32 - Math.clz32(rest));  // the last one is what is missing
  const [symbols, bits] = [new Uint8Array(1 << log), new Uint8Array(1 << log)];
  let place = 0;
  for (let weight = 1; weight <= log; weight += 1) {
    weights.forEach((of, symbol) => {
      if (of !== weight) return;
      const behind_it = place + (1 << (weight - 1));
      symbols.fill(symbol, place, behind_it);
      bits.fill(log + 1 - weight, place, behind_it);
      place = behind_it;
    });
  }
  check(place === 1 << log, "a tree of Zstandard is not whole");
  return [{ symbols, bits, log }, behind];
}

// `count` literals of one stream, input[at, end), to output[out …).
export function read_literals({ symbols, bits, log }, input, at, end, output, out, count) {
  const from = new backward_bits(input, at, end);
  const { first } = from;
  const mask = (1 << log) - 1;
  let bit = from.at;
  for (const behind = out + count; out < behind; out += 1) {
    const low = bit - log;
    let next;
    if (low >= first) {
      const byte = low >> 3;
      next = ((input[byte] | (input[byte + 1] << 8) | (input[byte + 2] << 16)) >> (low & 7)) & mask;
    } else {
      next = from.peek_at(low, log);
    }
    output[out] = symbols[next];
    bit -= bits[next];
    check(bit >= first, "literals of Zstandard end too early");
  }
  check(bit === first, "literals of Zstandard go on too long");
}

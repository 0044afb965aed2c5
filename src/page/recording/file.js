// SPDX-License-Identifier: Apache-2.0
// A file on this device, read in pieces: never more of it than somebody asks for.

import { damage, reader } from "./bytes.js";

// Each read costs some milliseconds, whatever its size: what is near is read with what lies between.
const window_bytes = { near: 4 << 20, far: 1 << 15 };

export class file_bytes {
  #file;
  #window = new Uint8Array(0);
  #window_at = 0;

  // `file` as File, or anything with its size and slice().
  constructor(file) {
    this.#file = file;
    this.size = file.size;
  }

  async read(at, count) {
    if (!(at >= 0 && count <= this.size - at)) throw new damage("the file ends too early");
    const bytes = new Uint8Array(await this.#file.slice(at, at + count).arrayBuffer());
    if (bytes.length !== count) throw new damage("the file has become shorter");
    return bytes;
  }

  // The same for a few bytes, one place after the other. What is at hand already needs no waiting: `holds`
  // says so, and `near` gives a reader of `count` bytes.
  holds(at, count) {
    return at >= this.#window_at && at + count <= this.#window_at + this.#window.length;
  }
  near(at, count) {
    const begin = at - this.#window_at;
    return new reader(this.#window, begin, begin + count);
  }
  async move(at, count) {
    const is_near = Math.abs(at - this.#window_at) < 2 * window_bytes.near;
    const bytes = Math.min(is_near ? window_bytes.near : window_bytes.far, this.size - at);
    this.#window = await this.read(at, Math.max(count, bytes));
    this.#window_at = at;
  }
}

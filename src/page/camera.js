// SPDX-License-Identifier: Apache-2.0
// Images (sensor_msgs/CompressedImage), each drawn as it comes; those that come while one is still decoded
// are passed over, but for the newest.

const bytes_max = 8e6;   // of one image, as text
const pixels_max = 4e7;

// The bytes of a message's image: base64, as rosbridge writes them, or numbers; null for anything else.
export function bytes_of(message) {
  const data = message?.data;
  if (Array.isArray(data)) {
    return data.length <= bytes_max && data.every(Number.isInteger) ? Uint8Array.from(data) : null;
  }
  if (typeof data !== "string" || data.length > bytes_max) return null;
  try {
    const text = atob(data);
    const bytes = new Uint8Array(text.length);
    for (let at = 0; at < text.length; at += 1) bytes[at] = text.charCodeAt(at);
    return bytes;
  } catch {
    return null;
  }
}

// How many pixels a PNG or a JPEG has, by its head: a small file may unpack to more memory than there is.
// NaN: it is neither.
export function pixels_of(bytes) {
  const short = (at) => bytes[at] * 256 + bytes[at + 1];
  if (short(0) === 0x8950) return (short(16) * 65536 + short(18)) * (short(20) * 65536 + short(22));
  if (short(0) !== 0xffd8) return NaN;
  for (let at = 2; at + 9 < bytes.length && bytes[at] === 0xff; at += 2 + short(at + 2)) {
    const marker = bytes[at + 1];  // of a frame: C0 to CF, but for tables
    if (marker >= 0xc0 && marker <= 0xcf && ![0xc4, 0xc8, 0xcc].includes(marker)) {
      return short(at + 5) * short(at + 7);
    }
  }
  return NaN;
}

export class camera {
  #canvas;
  #next = null;
  #busy = false;
  #shows = 0;          // which camera; counts up
  unreadable = false;  // the last one was no image

  constructor(canvas) { this.#canvas = canvas; }

  // For another one, or none.
  clear() {
    this.#shows += 1;
    this.#next = null;
    this.unreadable = false;
    this.#canvas.width = this.#canvas.height = 0;
  }

  async take(message) {
    this.#next = message;
    if (this.#busy) return;
    this.#busy = true;
    while (this.#next) {
      const one = this.#next;
      this.#next = null;
      this.unreadable = !await this.#draw(bytes_of(one)).catch(() => false);
    }
    this.#busy = false;
  }

  async #draw(bytes) {
    const shows = this.#shows;
    if (!bytes || !(pixels_of(bytes) <= pixels_max)) return false;
    const image = await createImageBitmap(new Blob([bytes]));
    if (shows === this.#shows) {  // else it is of the one before
      const { width, height } = image;
      const canvas = this.#canvas;
      if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
      canvas.getContext("2d").drawImage(image, 0, 0);
    }
    image.close();
    return true;
  }
}

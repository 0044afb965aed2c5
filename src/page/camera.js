// SPDX-License-Identifier: Apache-2.0
// Images (sensor_msgs/CompressedImage), each drawn as it comes; those that come while one is still decoded
// are passed over, but for the newest.

const bytes_max = 8e6;   // of one image, as text
const pixels_max = 4e7;

// The bytes of a message's image: base64, as rosbridge writes them, or numbers; null for anything else.
export function bytes_of(message) {
  const data = message?.data;
  if (Array.isArray(data)) return data.length <= bytes_max ? Uint8Array.from(data) : null;
  if (typeof data !== "string" || data.length > bytes_max) return null;
  try {
    return Uint8Array.from(atob(data), (each) => each.charCodeAt(0));
  } catch {
    return null;
  }
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
      this.unreadable = !await this.#draw(bytes_of(one));
    }
    this.#busy = false;
  }

  async #draw(bytes) {
    const shows = this.#shows;
    const image = bytes && await createImageBitmap(new Blob([bytes])).catch(() => null);
    if (shows !== this.#shows) return true;  // it is of the one before
    if (!image) return false;
    const { width, height } = image;
    const fits = width * height <= pixels_max;
    if (fits) {
      const canvas = this.#canvas;
      if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
      canvas.getContext("2d").drawImage(image, 0, 0);
    }
    image.close();
    return fits;
  }
}

// SPDX-License-Identifier: Apache-2.0
// A map (nav_msgs/OccupancyGrid) below the path: what is taken in ink, what is free as paper, what is not
// known left out. It is drawn once when it comes, and then moved as a picture.

import { far, heading_of, is_place } from "./pose.js";

const side_max = 16384;  // cells
const cells_max = 4e6;
const taken_least = 50;  // of 100

// {width, height, resolution, x, y, heading, cells}, or null for what is no map, or too large.
export function grid_of(map) {
  const { info, data } = map ?? {};
  const { width, height, resolution, origin } = info ?? {};
  const is_side = (side) => Number.isInteger(side) && side > 0 && side <= side_max;
  const cells = width * height;
  if (!is_side(width) || !is_side(height) || cells > cells_max) return null;
  if (!Array.isArray(data) || data.length !== cells || !data.every(Number.isFinite)) return null;
  if (!(resolution > 0 && resolution * Math.max(width, height) <= far)) return null;
  const { x, y } = origin?.position ?? {};
  if (!is_place(x, y)) return null;
  const heading = origin.orientation ? heading_of(origin.orientation) : 0;
  return { width, height, resolution, x, y, heading: Number.isFinite(heading) ? heading : 0, cells: data };
}

// A colour as colours.css has them, #rgb or #rrggbb.
const rgb_of = (colour) => {
  const digits = colour.slice(1).replace(/^(.)(.)(.)$/, "$1$1$2$2$3$3");
  return [0, 2, 4].map((at) => parseInt(digits.slice(at, at + 2), 16));
};

export class grid_layer {
  #grid = null;
  #picture = null;
  #drawn_in = "";  // the colours of the picture

  cells = 0;  // also of what is not drawn

  take(map) {
    this.cells = map?.data?.length ?? 0;
    this.#grid = grid_of(map);
    this.#picture = null;
  }

  // Metres, of its four corners.
  bounds() {
    if (!this.#grid) return null;
    const { x, y, width, height, resolution, heading } = this.#grid;
    const [c, s] = [Math.cos(heading) * resolution, Math.sin(heading) * resolution];
    const corners = [[0, 0], [width, 0], [0, height], [width, height]];
    const xs = corners.map(([along, across]) => x + c * along - s * across);
    const ys = corners.map(([along, across]) => y + s * along + c * across);
    return { left: Math.min(...xs), right: Math.max(...xs), low: Math.min(...ys), high: Math.max(...ys) };
  }

  // `view` as path_view.
  draw(view) {
    if (!this.#grid) return;
    const { pen, scale } = view;
    const { x, y, resolution, heading } = this.#grid;
    pen.save();
    pen.translate(view.left(x), view.top(y));
    pen.rotate(-heading);
    pen.scale(resolution * scale, -resolution * scale);
    pen.imageSmoothingEnabled = false;
    pen.drawImage(this.#painted(view.colours), 0, 0);
    pen.restore();
  }

  #painted({ ink, surface }) {
    if (this.#picture && this.#drawn_in === ink + surface) return this.#picture;
    const { width, height, cells } = this.#grid;
    const made = Object.assign(document.createElement("canvas"), { width, height });
    const pen = made.getContext("2d");
    const pixels = pen.createImageData(width, height);
    const words = new Uint32Array(pixels.data.buffer);
    const [taken, free] = [ink, surface].map((colour) => new Uint32Array(
      Uint8Array.of(...rgb_of(colour), 255).buffer)[0]);
    for (let at = 0; at < words.length; at += 1) {
      const cell = cells[at];
      if (cell >= 0 && cell <= 100) words[at] = cell >= taken_least ? taken : free;
    }
    pen.putImageData(pixels, 0, 0);
    this.#drawn_in = ink + surface;
    return (this.#picture = made);
  }
}

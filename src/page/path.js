// SPDX-License-Identifier: Apache-2.0
// The path: a fixed memory of where the robot has been, and its drawing on a canvas with equal axes.
//
// A point is kept when it lies `spacing` from the last one kept, so that a robot that stands still does not
// use the memory up; the newest `points_max` remain. The view holds the whole path, and then moves only when
// it must; or keeps the robot in its middle; or stays where a person put it. What the robot sees are layers
// below and above the path. Nothing is drawn unless something changed.

const points_max = 2000;
const lines_max = 100;       // of the grid, in one direction
const axes_width_min = 260;  // pixels
const spacing = 0.01;      // metres
const leap = 5;            // metres between two messages that no robot drives: the path is broken there
const margin = 0.1;        // of the view's width, kept free around the whole path
const span_min = 2;        // metres, the narrowest view
const span_max = 20000;
const follow_share = 0.4;  // of the whole path's width that is seen while following
const zoom_max = 16;
const colour_names = ["surface", "sunk", "grid", "axis", "accent", "ink", "quiet", "two"];
const settle_ms = 110;     // time constant of the view's movement
const origin = { x: 0, y: 0, heading: 0 };

// A ring of points. A set `broken` bit says that what lies between a point and the one before it is not
// known.
export class trail {
  constructor(capacity = points_max) {
    this.capacity = capacity;
    this.xs = new Float64Array(capacity);
    this.ys = new Float64Array(capacity);
    this.broken = new Uint8Array(capacity);
    this.clear();
  }

  clear() {
    this.first = 0;
    this.size = 0;
  }

  // The place in xs, ys and broken of point `index`, 0 being the oldest.
  at(index) {
    return (this.first + index) % this.capacity;
  }

  // Keeps the point if it is far enough from the last; `apart` when messages were missed before it.
  add(x, y, apart) {
    if (this.size > 0) {
      const last = this.at(this.size - 1);
      const distance = Math.hypot(x - this.xs[last], y - this.ys[last]);
      if (distance < spacing) return;
      apart ||= distance > leap;
    }
    if (this.size === this.capacity) this.first = (this.first + 1) % this.capacity;
    else this.size += 1;
    const place = this.at(this.size - 1);
    this.xs[place] = x;
    this.ys[place] = y;
    this.broken[place] = apart ? 1 : 0;
  }
}

// The largest of 1, 2, 5 times a power of ten that is not above `length`.
export function round_length(length) {
  const power = 10 ** Math.floor(Math.log10(length));
  const step = [5, 2, 1].find((each) => each * power <= length * (1 + 1e-9));
  return Number((step * power).toPrecision(1));
}

export class path_view {
  // `words` write what stands in the corners: bar_metres(length) and axes. `still` turns the view's movement
  // into jumps.
  constructor(canvas, words, still) {
    this.canvas = canvas;
    this.pen = canvas.getContext("2d");
    this.words = words;
    this.still = still;
    this.below = [];       // layers, each with draw(this) and bounds(this): {left, right, low, high} or null
    this.above = [];
    this.trail = new trail();
    this.pose = null;
    this.mode = "whole";   // or "follow", or "free"
    this.zoomed = 1;       // of what is seen while following
    this.colours = {};
    this.goal = { x: 0, y: 0, span: 4 };
    this.view = { ...this.goal };
    this.settled = false;  // the first pose is jumped to
    this.dirty = true;
    this.drawn_at = 0;
    new ResizeObserver(() => this.#resize()).observe(canvas);
    this.recolour();
  }

  // To be called when the page's colours changed.
  recolour() {
    const style = getComputedStyle(this.canvas);
    for (const name of colour_names) {
      this.colours[name] = style.getPropertyValue(`--${name}`).trim();
    }
    this.dirty = true;
  }

  // To be called when a layer changed.
  touch() { this.dirty = true; }

  // Where the robot is, as far as somebody has to know: without poses what it sees is around the origin.
  get place() { return this.pose ?? (this.above.length > 0 ? origin : null); }

  clear() {
    this.trail.clear();
    this.pose = null;
    this.settled = false;
    this.dirty = true;
  }

  add(pose, apart) {
    this.trail.add(pose.x, pose.y, apart);
    this.pose = pose;
    this.dirty = true;
  }

  follow(following) {
    this.mode = following ? "follow" : "whole";
    this.zoomed = 1;
    this.dirty = true;
  }

  // Shows `times` as little; the robot stays in the middle while it is followed.
  zoom(times) {
    this.dirty = true;
    if (this.mode === "follow") {
      this.zoomed = Math.min(zoom_max, Math.max(1 / zoom_max, this.zoomed * times));
      return;
    }
    this.mode = "free";
    this.goal = { ...this.goal, span: Math.min(span_max, Math.max(span_min / 4, this.goal.span / times)) };
  }

  // Moves what is seen by so many pixels.
  pan(right, down) {
    this.mode = "free";
    for (const seen of [this.goal, this.view]) {
      seen.x -= right / this.scale;
      seen.y += down / this.scale;
    }
    this.dirty = true;
  }

  // Draws if something changed since the last call; `now` is the time of the animation frame.
  draw(now) {
    if (!this.dirty || this.canvas.width === 0) return;
    this.dirty = false;
    this.#aim();
    this.#move(now);
    const { pen, canvas } = this;
    const dots = canvas.width / canvas.clientWidth;
    pen.setTransform(dots, 0, 0, dots, 0, 0);
    [this.width, this.height] = [canvas.clientWidth, canvas.clientHeight];
    pen.clearRect(0, 0, this.width, this.height);
    this.scale = Math.min(this.width, this.height) / this.view.span;
    const cell = round_length(this.view.span / 4.5);
    for (const layer of this.below) layer.draw(this);
    this.#draw_grid(cell);
    this.#draw_trail();
    if (this.place) for (const layer of this.above) layer.draw(this);
    if (this.pose) this.#draw_robot();
    this.#draw_scale(cell);
  }

  #resize() {
    const [wide, high] = [this.canvas.clientWidth, this.canvas.clientHeight];
    const [width, height] = [wide, high].map((each) => Math.round(each * devicePixelRatio));
    if (width === this.canvas.width && height === this.canvas.height) return;
    Object.assign(this.canvas, { width, height });
    this.dirty = true;
  }

  // Where a place of the world is, in pixels.
  left(x) {
    return this.width / 2 + (x - this.view.x) * this.scale;
  }

  top(y) {
    return this.height / 2 - (y - this.view.y) * this.scale;
  }

  // Chooses the view to move to. The one that holds the whole path stays as it is while the path fits well.
  #aim() {
    const { place: at } = this;
    if (!at || this.mode === "free") return;
    let [left, right, low, high] = [at.x, at.x, at.y, at.y];
    for (let index = 0; index < this.trail.size; index += 1) {
      const place = this.trail.at(index);
      left = Math.min(left, this.trail.xs[place]);
      right = Math.max(right, this.trail.xs[place]);
      low = Math.min(low, this.trail.ys[place]);
      high = Math.max(high, this.trail.ys[place]);
    }
    // A map says how far the world goes; without one, a scan does.
    const bounds = (layers) => layers.map((layer) => layer.bounds(this)).filter(Boolean);
    const mapped = bounds(this.below);
    for (const box of mapped.length > 0 ? mapped : bounds(this.above)) {
      [left, right] = [Math.min(left, box.left), Math.max(right, box.right)];
      [low, high] = [Math.min(low, box.low), Math.max(high, box.high)];
    }
    const wanted = Math.max(span_min, Math.max(right - left, high - low) / (1 - 2 * margin));
    if (this.mode === "follow") {
      const span = Math.max(span_min, wanted * follow_share) / this.zoomed;
      this.goal = { x: at.x, y: at.y, span };
      return;
    }
    const reach = this.goal.span * (0.5 - margin / 2);
    const fits =
      left >= this.goal.x - reach && right <= this.goal.x + reach &&
      low >= this.goal.y - reach && high <= this.goal.y + reach && wanted * 1.7 >= this.goal.span;
    if (fits && this.settled) return;
    this.goal = { x: (left + right) / 2, y: (low + high) / 2, span: wanted * 1.15 };
  }

  #move(now) {
    const { view, goal } = this;
    const jump = this.still || !this.settled;
    const share = jump ? 1 : 1 - Math.exp(-Math.min(100, now - this.drawn_at) / settle_ms);
    this.drawn_at = now;
    if (this.place) this.settled = true;
    for (const name of ["x", "y", "span"]) view[name] += (goal[name] - view[name]) * share;
    const far = Math.max(...["x", "y", "span"].map((name) => Math.abs(goal[name] - view[name])));
    if (far > goal.span / 2000) this.dirty = true;  // still moving: one more frame
    else Object.assign(view, goal);
  }

  #draw_grid(cell) {
    const { pen, view, width, height, scale, colours } = this;
    pen.lineWidth = 1;
    const line = (index, horizontal) => {
      const at = Math.round(horizontal ? this.top(index * cell) : this.left(index * cell)) + 0.5;
      pen.strokeStyle = index === 0 ? colours.axis : colours.grid;
      pen.beginPath();
      pen.moveTo(horizontal ? 0 : at, horizontal ? at : 0);
      pen.lineTo(horizontal ? width : at, horizontal ? at : height);
      pen.stroke();
    };
    for (const horizontal of [false, true]) {
      const middle = horizontal ? view.y : view.x;
      const half = (horizontal ? height : width) / 2 / scale;
      const first = Math.ceil((middle - half) / cell);
      const lines = Math.min(lines_max, Math.floor((middle + half) / cell) - first + 1);
      for (let index = 0; index < lines; index += 1) line(first + index, horizontal);
    }
  }

  // In a few strokes of growing strength, so that one sees which end is old.
  #draw_trail() {
    const { pen, trail: path } = this;
    pen.strokeStyle = this.colours.accent;
    pen.lineWidth = 3;
    pen.lineJoin = "round";
    pen.lineCap = "butt";  // round ends of translucent strokes would show as dots where they meet
    const strokes = 16;
    for (let stroke = 0; stroke < strokes; stroke += 1) {
      const begin = Math.floor((path.size * stroke) / strokes);
      const end = Math.floor((path.size * (stroke + 1)) / strokes);
      if (begin === end) continue;
      pen.globalAlpha = 0.2 + (0.8 * (stroke + 1)) / strokes;
      pen.beginPath();
      for (let index = Math.max(0, begin - 1); index < end; index += 1) {
        const place = path.at(index);
        const apart = path.broken[place] || index === Math.max(0, begin - 1);
        pen[apart ? "moveTo" : "lineTo"](this.left(path.xs[place]), this.top(path.ys[place]));
      }
      if (end === path.size) pen.lineTo(this.left(this.pose.x), this.top(this.pose.y));
      pen.stroke();
    }
    pen.globalAlpha = 1;
  }

  // An arrow head along the heading; a disc where no heading is known.
  #draw_robot() {
    const { pen, colours, pose } = this;
    pen.save();
    pen.translate(this.left(pose.x), this.top(pose.y));
    pen.beginPath();
    pen.arc(0, 0, 19, 0, 2 * Math.PI);
    pen.fillStyle = colours.surface;
    pen.fill();
    pen.lineWidth = 2;
    pen.strokeStyle = colours.ink;
    pen.stroke();
    pen.beginPath();
    if (Number.isFinite(pose.heading)) {
      pen.rotate(-pose.heading);
      pen.moveTo(12, 0);
      pen.lineTo(-8, 8);
      pen.lineTo(-4, 0);
      pen.lineTo(-8, -8);
      pen.closePath();
    } else {
      pen.arc(0, 0, 6, 0, 2 * Math.PI);
    }
    pen.fillStyle = colours.ink;
    pen.fill();
    pen.restore();
  }

  // One cell of the grid with its length, and which way x and y point.
  #draw_scale(cell) {
    const { pen, width, height, colours } = this;
    const [left, bottom, length] = [14.5, height - 14.5, Math.round(cell * this.scale)];
    pen.lineJoin = "miter";
    pen.beginPath();
    pen.moveTo(left, bottom - 7);
    pen.lineTo(left, bottom);
    pen.lineTo(left + length, bottom);
    pen.lineTo(left + length, bottom - 7);
    for (const [width, colour] of [[5, colours.surface], [1.5, colours.quiet]]) {
      pen.lineWidth = width;
      pen.strokeStyle = colour;
      pen.stroke();
    }
    this.#write(this.words.bar_metres(cell), left + length + 8, bottom + 0.5, "left");
    if (width > axes_width_min) this.#write(this.words.axes, width - 14, bottom + 0.5, "right");
  }

  #write(words, x, y, align) {
    const { pen, colours } = this;
    pen.font = "12px system-ui, sans-serif";
    pen.textAlign = align;
    pen.textBaseline = "alphabetic";
    pen.lineJoin = "round";
    pen.lineWidth = 4;
    pen.strokeStyle = colours.surface;
    pen.fillStyle = colours.quiet;
    pen.strokeText(words, x, y);
    pen.fillText(words, x, y);
  }
}

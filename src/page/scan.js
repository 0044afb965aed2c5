// SPDX-License-Identifier: Apache-2.0
// A laser scan (sensor_msgs/LaserScan) on the map, drawn where the robot is: where on the robot its scanner
// sits is not known here, and is taken to be its middle.

const points_max = 2000;  // drawn of one scan; of more, every second, third, …
const range_most = 1e5;   // metres
const size = 3;           // pixels of a point
const reach_share = 0.9;  // of the points, that the view holds: one through an open door is far away

// x and y in turn, in metres in the scanner's frame, of all beams that met something; JSON writes null for
// what is no number.
export function points_of(scan) {
  const { ranges, angle_min: first, angle_increment: step } = scan ?? {};
  if (!Array.isArray(ranges) || !Number.isFinite(first) || !Number.isFinite(step)) return [];
  const { range_min: near = 0 } = scan;
  const far = Math.min(scan.range_max ?? Infinity, range_most);
  const every = Math.ceil(ranges.length / points_max);
  const points = [];
  for (let beam = 0; beam < ranges.length; beam += every) {
    const range = ranges[beam];
    if (typeof range !== "number" || !(range >= near && range <= far)) continue;
    const angle = first + beam * step;
    points.push(range * Math.cos(angle), range * Math.sin(angle));
  }
  return points;
}

// How far most points are, in metres.
export function reach_of(points) {
  const far = [];
  for (let at = 0; at < points.length; at += 2) far.push(Math.hypot(points[at], points[at + 1]));
  far.sort((one, other) => one - other);
  return far[Math.floor((far.length - 1) * reach_share)] ?? 0;
}

export class scan_layer {
  #points = [];
  reach = 0;
  fresh = () => true;

  take(scan) {
    this.#points = points_of(scan);
    this.reach = reach_of(this.#points);
  }

  // Metres, around the robot.
  bounds({ place }) {
    if (this.reach === 0) return null;
    const { x, y } = place;
    return { left: x - this.reach, right: x + this.reach, low: y - this.reach, high: y + this.reach };
  }

  // `view` as path_view.
  draw(view) {
    const { pen, place, colours } = view;
    const { x, y, heading } = place;
    const [c, s] = Number.isFinite(heading) ? [Math.cos(heading), Math.sin(heading)] : [1, 0];
    pen.fillStyle = this.fresh() ? colours.two : colours.quiet;
    const points = this.#points;
    for (let at = 0; at < points.length; at += 2) {
      const [along, across] = [points[at], points[at + 1]];
      const left = view.left(x + c * along - s * across);
      const top = view.top(y + s * along + c * across);
      pen.fillRect(left - size / 2, top - size / 2, size, size);
    }
  }
}

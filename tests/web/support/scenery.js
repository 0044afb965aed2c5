// SPDX-License-Identifier: Apache-2.0
// A robot in a room, for scripted_page, with all that the page can show: a pose that moves, a laser scan, a
// map, a camera, a stop, controls, parameters, services, peers and a loss.

import { deflateSync } from "node:zlib";
import { stats_of } from "./scripted.js";

const room = { left: -3.2, right: 3.6, low: -2.4, high: 2.6 };
const pillars = [[0.1, 1.6, 0.3], [-0.4, -1.5, 0.25]];  // x, y, radius; metres
const lap_s = 24;

// Along a figure of eight.
export function pose_at(s) {
  const u = (2 * Math.PI * s) / lap_s;
  const [vx, vy] = [2 * Math.cos(u), 2 * Math.cos(2 * u)].map((each) => (each * 2 * Math.PI) / lap_s);
  return { x: 2 * Math.sin(u), y: Math.sin(2 * u), heading: Math.atan2(vy, vx), speed: Math.hypot(vx, vy) };
}

// How far it is from x, y along an angle to a wall or a pillar.
function range_of(x, y, angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const walls = [((c > 0 ? room.right : room.left) - x) / c, ((s > 0 ? room.high : room.low) - y) / s];
  const hits = pillars.map(([px, py, radius]) => {
    const along = (px - x) * c + (py - y) * s;
    const apart = (px - x) ** 2 + (py - y) ** 2 - along ** 2;
    return along > 0 && apart < radius ** 2 ? along - Math.sqrt(radius ** 2 - apart) : Infinity;
  });
  return Math.min(...walls.filter((each) => each > 0), ...hits);
}

export function scan_at({ x, y, heading }) {
  const beams = 240;
  const step = (2 * Math.PI) / beams;
  const ranges = Array.from({ length: beams }, (_, beam) => range_of(x, y, heading - Math.PI + beam * step));
  return { angle_min: -Math.PI, angle_increment: step, range_min: 0.1, range_max: 12, ranges };
}

function map() {
  const resolution = 0.1;
  const position = { x: room.left - 0.3, y: room.low - 0.3, z: 0 };
  const origin = { position, orientation: { x: 0, y: 0, z: 0, w: 1 } };
  const width = Math.ceil((room.right - room.left + 0.6) / resolution);
  const height = Math.ceil((room.high - room.low + 0.6) / resolution);
  const cell = (at) => {
    const x = origin.position.x + ((at % width) + 0.5) * resolution;
    const y = origin.position.y + (Math.floor(at / width) + 0.5) * resolution;
    const out = Math.max(room.left - x, x - room.right, room.low - y, y - room.high);
    if (out > resolution) return -1;
    return out > 0 || pillars.some(([px, py, radius]) => Math.hypot(px - x, py - y) < radius) ? 100 : 0;
  };
  const data = Array.from({ length: width * height }, (_, at) => cell(at));
  return { info: { width, height, resolution, origin }, data };
}

// Node's own came after 18.
function crc32(bytes) {
  let crc = ~0;
  for (const each of bytes) {
    crc ^= each;
    for (let bit = 0; bit < 8; bit += 1) crc = (crc >>> 1) ^ (crc & 1 ? 0xedb88320 : 0);
  }
  return ~crc >>> 0;
}

// A PNG of width x height, its rows of RGB made by `pixel(x, y)`.
export function png(width, height, pixel) {
  const rows = Buffer.alloc(height * (1 + 3 * width));
  for (let y = 0; y < height; y += 1) {
    for (let x = 0; x < width; x += 1) rows.set(pixel(x, y), y * (1 + 3 * width) + 1 + 3 * x);
  }
  const chunk = (name, data) => {
    const body = Buffer.concat([Buffer.from(name, "latin1"), data]);
    const made = Buffer.alloc(body.length + 8);
    made.writeUInt32BE(data.length, 0);
    body.copy(made, 4);
    made.writeUInt32BE(crc32(body), body.length + 4);
    return made;
  };
  const head = Buffer.alloc(13);
  head.writeUInt32BE(width, 0);
  head.writeUInt32BE(height, 4);
  head.set([8, 2], 8);
  const signature = Buffer.from([0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a]);
  const parts = [chunk("IHDR", head), chunk("IDAT", deflateSync(rows)), chunk("IEND", Buffer.alloc(0))];
  return Buffer.concat([signature, ...parts]).toString("base64");
}

// A floor and a wall that meet at a horizon.
const view = png(320, 200, (x, y) => {
  if (y < 90) return [196 - y / 2, 202 - y / 2, 210 - y / 2];
  const near = (y - 88) / 112;
  const tile = (Math.floor((x - 160) / (18 * near + 2)) + Math.floor(14 / near)) % 2;
  return tile ? [120, 112, 100] : [148, 140, 126];
});

const tick = () => Math.round(performance.now());
export const stop_state = (more) => ({
  state: "running", number: 3, cause: null, source: null, since_ms: 240000, tick: tick(), unguarded: true,
  guards: [], loops: [{ name: "robot", age_ms: 0.4, acknowledged: 3 }], ...more,
});

// {messages, services} for scripted_page; what is in `more` stands in for messages.
export function scenery(more = {}) {
  const began = performance.now() - 20000;
  const pose = () => pose_at((performance.now() - began) / 1000);
  const odometry = () => {
    const { x, y, heading, speed } = pose();
    return { stamp: 1, x, y, heading, speed, turn_rate: 0.4 };
  };
  const topics = [["/odom", "nav_msgs/Odometry"], ["/scan", "sensor_msgs/LaserScan"],
    ["/map", "nav_msgs/OccupancyGrid"], ["/front/compressed", "sensor_msgs/CompressedImage"],
    ["/rear/compressed", "sensor_msgs/msg/CompressedImage"], ["/power", "demo/Power"], ["/rowe/stats", ""]];
  const losses = { full: 0, outbox_full: 3 };
  const stats = () => {
    const uptime_s = (performance.now() - began) / 1000;
    const loops = [{ name: "robot", cycles: Math.round(1000 * uptime_s), p50_us: 1003.519, p99_us: 1011.711,
      p999_us: 1052.671, max_us: 3214.7, bound_us: 100000 }];
    const said = stats_of(topics, { name: "room", uptime_s, losses, loops });
    for (const each of said.topics) each.messages = Math.round(10 * uptime_s);
    return said;
  };
  const power = () => ({ volts: 24 + Math.sin(performance.now() / 3000) / 2, amps: 3 + Math.random() / 4 });
  const control = () => ({ tick: tick(), topics: [
    { topic: "/cmd_vel", lease_ms: 500, hold_ms: 2000, driver: null, number: 0, age_ms: null }] });
  const messages = {
    "/odom": odometry, "/scan": () => scan_at(pose()), "/map": map(), "/power": power,
    "/front/compressed": { format: "png", data: view }, "/rear/compressed": { format: "png", data: view },
    "/rowe/stats": stats, "/rowe/stop/state": stop_state, "/rowe/control/state": control,
    "/rowe/parameters": { values: { "/robot/speed_max": 1, "/robot/lamp": true } }, ...more,
  };
  const services = {
    "/rowe/stop/state": () => stop_state(),
    "/rowe/rights": ({ asked }) => ({ role: null, identity: null, allowed: asked.map(() => true) }),
    "/rowe/control": () => ({ ...control().topics[0], yours: false, tick: 1, refused: null }),
    "/rowe/stats": () => ({ connections: [
      { address: "10.0.0.7:51000", name: "wall", ["dialect"]: "rosbridge", role: "observer",
        queued: 0, blocked: false, silent_s: 0.2 },
      { address: "10.0.0.9:51002", ["dialect"]: "foxglove", role: "driver",
        queued: 5, blocked: true, silent_s: 3 }] }),
    "/rosapi/get_time": () => ({ time: { secs: Math.floor(Date.now() / 1000), nsecs: 0 } }),
    "/rosapi/get_param_names": () => ({ names: ["/robot/speed_max", "/robot/lamp"] }),
    "/rosapi/get_param": ({ name }) => ({ value: name.endsWith("lamp") ? "true" : "1", successful: true }),
    "/rosapi/services": () => ({ services: ["/robot/set_speed"] }),
  };
  return { messages, services };
}

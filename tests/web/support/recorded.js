// SPDX-License-Identifier: Apache-2.0
// A recording as a robot makes it, for tests of the page: a minute of a figure of eight, with two stops and a
// loss.

import zstd from "@foxglove/wasm-zstd";
import { McapWriter, TempBuffer } from "@mcap/core";
import { pose_at, scan_at, scenery } from "./scenery.js";

const text = (words) => new TextEncoder().encode(words);
const stats = (at_ms) => ({ name: "ang-01", epoch: 1, uptime_s: at_ms / 1000, peers: 2, topics: [],
  losses: { full: 0, outbox_full: 3 }, cycle_us_max: 212, loops: [{ name: "robot", cycles: at_ms,
    p50_us: 1003.5, p99_us: 1011.7, p999_us: 1052.6, max_us: 3214, bound_us: 1e5 }] });

export const begin_ms = Date.UTC(2026, 10, 30, 4, 9, 58);
export const stops = [[12000, 15000, "request", "joystick"], [40000, 41000, "loop", "robot"]];
export const lost_at_ms = 25000;

function stop_state(at_ms) {
  const begun = stops.filter(([begin]) => begin <= at_ms);
  const now = begun.find(([, end]) => at_ms < end);
  const since = now ? now[0] : begun.at(-1)?.[1] ?? 0;
  return { state: now ? "stopped" : "running", number: 3 + begun.length, cause: now?.[2] ?? null,
    source: now?.[3] ?? null, since_ms: at_ms - since, unguarded: true, guards: [], loops: [] };
}

// [topic, type, period in ms, message at a time since the begin]; 0: once.
const pose = (at_ms) => pose_at(at_ms / 1000);
const topics = [
  ["/odom", "nav_msgs/Odometry", 20, (at_ms) => ({ stamp: at_ms / 1000, ...pose(at_ms), turn_rate: 0.4 })],
  ["/scan", "sensor_msgs/LaserScan", 100, (at_ms) => scan_at(pose(at_ms))],
  ["/map", "nav_msgs/OccupancyGrid", 0, () => scenery().messages["/map"]],
  ["/power", "demo/Power", 100, (at_ms) => ({ volts: 24 + Math.sin(at_ms / 3000) / 2, amps: 3 })],
  ["/rowe/stop/state", "rowe/StopState", 200, stop_state],
  ["/rowe/stats", "rowe/Stats", 500, stats],
];

// Its bytes; `how`: options of McapWriter.
export async function recorded({ length_ms = 60000, ...how } = {}) {
  await zstd.isLoaded;
  const writable = new TempBuffer();
  const writer = new McapWriter({ writable, chunkSize: 30000, compressChunk: (data) =>
    ({ compression: "zstd", compressedData: zstd.compress(data) }), ...how });
  await writer.start({ profile: "", library: "rowe" });
  const register = async (topic, type, messageEncoding) => {
    const schemaId = await writer.registerSchema({ name: type, encoding: "jsonschema", data: text("{}") });
    return writer.registerChannel({ topic, messageEncoding, schemaId, metadata: new Map() });
  };
  const ids = [];
  for (const [topic, type] of topics) ids.push(await register(topic, type, "json"));
  const foreign = await register("/tf", "tf2_msgs/TFMessage", "cdr");
  const lost = await register("/rowe/record/lost", "rowe/RecordLoss", "json");
  const add = (channelId, at_ms, data) => {
    const logTime = BigInt(begin_ms + at_ms) * 1000000n;
    return writer.addMessage({ channelId, sequence: 0, logTime, publishTime: logTime, data });
  };
  for (let at_ms = 0; at_ms <= length_ms; at_ms += 20) {
    for (const [index, [, , period_ms, message]] of topics.entries()) {
      if (period_ms === 0 ? at_ms > 0 : at_ms % period_ms > 0) continue;
      await add(ids[index], at_ms, text(JSON.stringify(message(at_ms))));
    }
    if (at_ms % 1000 === 0) await add(foreign, at_ms, Uint8Array.of(0, 1, 0, 0, 0, 0, 0, 0));
    if (at_ms === lost_at_ms) await add(lost, at_ms, text('{"topic":"/scan","messages":7}'));
  }
  await writer.addMetadata({ name: "rowe", metadata: new Map([["name", "ang-01"]]) });
  await writer.end();
  return Buffer.from(writable.get());
}

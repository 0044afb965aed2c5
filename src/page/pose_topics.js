// SPDX-License-Identifier: Apache-2.0
// Which topics hold poses: those whose type says so, and those of unknown type into which it was looked, one
// at a time, for one message.

import { moment, since_ms } from "../../clients/js/src/link.js";
import { is_odometry, is_pose_type, pose_of } from "./pose.js";

const look_ms_max = 3000;      // a topic is looked at for so long …
const look_bytes_max = 4096;   // … if its messages are this small …
const looks_max = 64;          // … and not more of them than this
const look_hz = 1;

const is_own = ({ topic }) => topic.startsWith("/rowe/");

export class pose_topics {
  #feeds;
  #told = new Map();   // topic → what the robot lists of it
  #looked = new Map(); // topic → whether it holds poses
  #looking = null;     // {topic, at, feed}

  constructor(feeds) { this.#feeds = feeds; }

  // Whether a topic is known to hold poses.
  has(topic) {
    return this.#looked.get(topic) ?? is_pose_type(this.#told.get(topic)?.type);
  }

  // Odometry first: it moves with the robot, and steadily.
  get all() {
    const known = [...this.#told.values()].filter(({ topic }) => this.has(topic));
    return [true, false].flatMap((first) =>
      known.filter(({ type }) => is_odometry(type) === first).map(({ topic }) => topic));
  }

  // What was seen elsewhere of a topic.
  found(topic) { this.#looked.set(topic, true); }

  // `listed` as in /rowe/stats.
  take(listed) {
    this.#told = new Map(listed.map((entry) => [entry.topic, entry]));
    if (this.#looking && since_ms(this.#looking.at) > look_ms_max) this.#end(false);
    if (this.#looking || this.#looked.size >= looks_max) return;
    const next = listed.find((entry) => !is_own(entry) && !is_pose_type(entry.type) && entry.messages > 0 &&
      entry.bytes <= look_bytes_max && !this.#looked.has(entry.topic));
    if (!next) return;
    const feed = this.#feeds.want(next.topic, (msg) => this.#end(pose_of(msg) !== null), look_hz);
    this.#looking = { topic: next.topic, at: moment(), feed };
  }

  // Of another robot: nothing is known of its topics yet.
  clear() {
    this.#looking?.feed.end();
    this.#looking = null;
    this.#told.clear();
    this.#looked.clear();
  }

  #end(found) {
    const { topic, feed } = this.#looking;
    feed.end();
    this.#looked.set(topic, found);
    this.#looking = null;
  }
}

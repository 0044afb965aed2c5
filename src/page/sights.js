// SPDX-License-Identifier: Apache-2.0
// What the robot sees, known by the types of its topics: laser scans and a map under and over the path, and
// one camera beside it, which a person chooses where there are several.

import { camera } from "./camera.js";
import { choose_from, element, mark, write } from "./dom.js";
import { grid_layer } from "./grid.js";
import { scan_layer } from "./scan.js";
import { text } from "./text.js";

const scan_type = /^sensor_msgs\/(msg\/)?LaserScan$/;
const map_type = /^nav_msgs\/(msg\/)?OccupancyGrid$/;
const image_type = /^sensor_msgs\/(msg\/)?CompressedImage$/;
const scans_max = 2;       // in front and behind
const [scan_hz, map_hz, image_hz] = [10, 2, 10];
const [large_cells, large_map_hz] = [250000, 0.2];  // while it reads such a map a browser does nothing else
const apart = true;                                 // not on the connection of the stop
const stale_ms = 1500;

// Those that are shown stay in front: a topic that comes later takes nobody's place.
const of_type = (topics, type, shown) =>
  topics.filter((entry) => type.test(entry.type)).map(({ topic }) => topic)
    .sort((one, other) => shown(other) - shown(one) || (one < other ? -1 : 1));

export class sights {
  #feeds;
  #view;
  #layers = new Map();  // topic → {feed, layer}
  #visible = false;
  #camera = new camera(element("image"));
  #image = null;        // the feed of the camera that is shown
  #wanted = null;       // the camera that somebody chose
  #cameras = [];
  #front = null;        // what a person put in front: "camera" or "map"
  #at = "overview";
  changed = () => {};

  // `view` as path_view.
  constructor(feeds, view) {
    this.#feeds = feeds;
    this.#view = view;
    element("cameras").onchange = ({ target }) => this.#choose(target.value);
    element("swap").onclick = () => this.#swap();
    // A tap on the small one makes it the large one.
    element("image").onclick = () => this.front === "map" && this.#swap();
    element("path").addEventListener("click", () => this.front === "camera" && this.#swap());
  }

  // What a link carries: the camera, and what stands in front of what.
  get arranged() { return { camera: this.#wanted, front: this.#front }; }
  arrange({ camera: wanted, front }) {
    this.#wanted = wanted;
    this.#front = front;
    this.#look();
    this.#write();
  }

  // People steer by the camera where there is one.
  get front() {
    if (!this.#image) return "map";
    return this.#front ?? (this.#at === "drive" ? "camera" : "map");
  }

  // `at` is the view that is seen.
  visible(at) {
    this.#at = at;
    this.#visible = at === "overview" || at === "drive";
    for (const { feed, hz } of this.#layers.values()) feed.at(this.#visible ? hz : 0);
    this.#image?.at(this.#visible ? image_hz : 0);
    this.#write();
  }

  // `topics` as listed in /rowe/stats.
  take(topics) {
    const is_shown = (topic) => this.#layers.has(topic);
    const scans = of_type(topics, scan_type, is_shown).slice(0, scans_max);
    const maps = of_type(topics, map_type, is_shown).slice(0, 1);
    for (const [topic, { feed }] of this.#layers) {
      if (scans.includes(topic) || maps.includes(topic)) continue;
      feed.end();
      this.#layers.delete(topic);
    }
    for (const topic of maps) this.#add(topic, grid_layer, map_hz);
    for (const topic of scans) this.#add(topic, scan_layer, scan_hz);
    const of_kind = (kind) => [...this.#layers.values()].map(({ layer }) => layer).filter(
      (layer) => layer instanceof kind);
    Object.assign(this.#view, { below: of_kind(grid_layer), above: of_kind(scan_layer) });
    const before = this.#cameras.join();
    this.#cameras = of_type(topics, image_type, () => 0);
    this.#look();
    if (this.#cameras.join() !== before) this.#write();
  }

  #add(topic, kind, hz) {
    if (this.#layers.has(topic)) return;
    const layer = new kind();
    const feed = this.#feeds.want(topic, (msg) => {
      layer.take(msg);
      if (layer.cells > large_cells && this.#visible) feed.at(large_map_hz);
      this.#view.touch();
    }, this.#visible ? hz : 0, { apart, jumped: () => layer.take(null) });
    layer.fresh = () => feed.fresh(stale_ms);
    this.#layers.set(topic, { feed, layer, hz });
  }

  #look() {
    const [topic] = [this.#wanted, this.#image?.topic, ...this.#cameras]
      .filter((each) => this.#cameras.includes(each));
    if (this.#image?.topic === topic) return;
    this.#image?.end();
    this.#camera.clear();
    this.#image = topic === undefined ? null
      : this.#feeds.want(topic, (msg) => this.#camera.take(msg), this.#visible ? image_hz : 0,
        { apart, jumped: () => this.#camera.clear() });
    this.#write();
  }

  #choose(topic) {
    this.#wanted = topic;
    this.#look();
    this.changed();
  }

  #swap() {
    this.#front = this.front === "map" ? "camera" : "map";
    this.#write();
    this.changed();
  }

  #write() {
    const { front } = this;
    mark(element("stage"), "data-front", this.#image ? front : "alone");
    element("swap").hidden = this.#image === null;
    mark(element("swap"), "aria-pressed", front === "camera");
    choose_from(element("cameras"), this.#cameras, this.#image?.topic);
    this.#view.touch();
  }

  // Says what is wrong with the image, if anything is.
  turn() {
    if (!this.#image) return;
    const old = !this.#image.fresh(stale_ms);
    mark(element("image"), "data-old", old);
    const said = this.#camera.unreadable ? text.no_image : old ? text.no_new_image : "";
    write(element("image_says"), this.#image.refused ?? said);
  }
}

// SPDX-License-Identifier: Apache-2.0
// A robot in a few lines that has nothing but a driven topic and a stop, over the npm package ws: who drives,
// until when, and which commands count. A test may make it forget, refuse or fall silent.

import { once } from "node:events";
import { WebSocketServer } from "ws";

const lease_ms = 300;
const hold_ms = 2000;
const tick_ms = 50;

export class driven_robot {
  static async start(port = 0) {
    const made = new driven_robot();
    Object.assign(made, { driver: null, peers: new Set(), commands: [], asked: [] });
    Object.assign(made, { number: 7, stopped: false });
    made.server = new WebSocketServer({ host: "127.0.0.1", port });
    made.server.on("connection", (socket) => made.#serve(socket));
    await once(made.server, "listening");
    made.port = made.server.address().port;
    made.url = `ws://127.0.0.1:${made.port}/`;
    made.timer = setInterval(() => made.#tell(), tick_ms);
    return made;
  }

  get tick() { return Math.round(performance.now() * 1000); }

  #serve(socket) {
    const peer = { socket, name: null, id: `peer ${this.peers.size}`, topics: new Set() };
    this.peers.add(peer);
    socket.on("error", () => {});
    socket.on("close", () => {
      this.peers.delete(peer);
      if (this.driver === peer) this.driver = null;
    });
    socket.on("message", (data) => this.#take(peer, JSON.parse(data)));
  }

  #take(peer, message) {
    const { op, topic, id, service, args } = message;
    if (op === "subscribe") peer.topics.add(topic);
    if (op === "publish" && topic === "/cmd_vel") this.#command(peer, message);
    if (op !== "call_service") return;
    const answers = {
      "/rowe/control": () => this.#control(peer, args),
      "/rowe/stop": () => this.#stop(true),
      "/rowe/stop/reset": () => this.#stop(false),
      "/rowe/stop/state": () => this.#stop_state(),
    };
    const values = answers[service]?.() ?? `Service ${service} does not exist`;
    this.#say(peer, { op: "service_response", id, service, result: service in answers, values });
  }

  // A command counts from when its tick was issued.
  #command(peer, { msg, tick }) {
    if (this.driver !== peer || this.stopped || !(this.tick - tick < lease_ms * 1000)) return;
    this.until = tick + hold_ms * 1000;
    this.commands.push({ msg, tick, until: tick + lease_ms * 1000 });
  }

  // What it drives by now; null: it stands still.
  get moves() {
    const last = this.commands.at(-1);
    return last && this.driver && !this.stopped && this.tick < last.until ? last.msg : null;
  }

  #control(peer, { topic, action, name, tick }) {
    this.asked.push(action);
    const refused = this.refuses ?? (topic !== "/cmd_vel" ? "topic" : this.#refusal(peer, action, tick));
    if (!refused && action === "release" && this.driver === peer) this.driver = null;
    if (!refused && action !== "release") {
      if (this.driver !== peer) this.commands = [];
      this.driver = peer;
      peer.name = name;
      this.until = this.tick + hold_ms * 1000;
    }
    const [driver, yours] = [this.driver?.name ?? null, this.driver === peer];
    return { topic: "/cmd_vel", driver, yours, lease_ms, hold_ms, tick: this.tick, refused };
  }

  #refusal(peer, action, tick) {
    if (action === "take" && this.driver && this.driver !== peer) return "driven";
    if (action === "take_over" && !(this.tick - tick < 2e6)) return "tick";
    return null;
  }

  #stop(stopped) {
    this.stopped = stopped;
    this.commands = [];
    this.number += stopped ? 1 : 0;
    this.#tell();
    return { ...this.#stop_state(), accepted_ns: "1000", observed_ns: "2000", refused: null };
  }

  #stop_state() {
    const { tick, number } = this;
    const state = this.stopped ? "stopped" : "running";
    return { state, number, since_ms: 1, tick, unguarded: true, guards: [], loops: [] };
  }

  #tell() {
    if (this.driver && this.tick > this.until) this.driver = null;
    if (this.silent) return;
    const { name: driver = null, id: driver_id = null } = this.driver ?? {};
    const one = { topic: "/cmd_vel", lease_ms, hold_ms, driver, driver_id, since_ms: 0, age_ms: 0 };
    const control = { tick: this.tick, topics: [one] };
    const said = { "/rowe/control/state": control, "/rowe/stop/state": this.#stop_state() };
    for (const peer of this.peers) {
      for (const [topic, msg] of Object.entries(said)) {
        if (peer.topics.has(topic)) this.#say(peer, { op: "publish", topic, msg });
      }
    }
  }

  #say({ socket }, message) { socket.send(JSON.stringify(message)); }

  async end() {
    clearInterval(this.timer);
    for (const { socket } of this.peers) socket.terminate();
    this.server.close();
    await once(this.server, "close");
  }
}

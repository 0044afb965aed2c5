// SPDX-License-Identifier: Apache-2.0
// Plain JSON messages over the npm package ws, as a client or as a server: what anybody would write who has
// read no more than that a message is a JSON object and a call has a `message_id`.

import { once } from "node:events";
import { WebSocket, WebSocketServer } from "ws";
import { until } from "./watchdog.js";

// One end of a connection: what came, and how it ended.
export class plain_peer {
  constructor(socket) {
    this.socket = socket;
    this.texts = [];
    this.ended = null;
    socket.on("message", (data, binary) => {
      if (binary) throw new Error("a binary message");
      this.texts.push(String(data));
      this.on_message?.(JSON.parse(data));
    });
    socket.on("close", (code, reason) => (this.ended = { code, reason: String(reason) }));
    socket.on("error", () => {});  // is followed by close
  }

  static async connect(url, ...how) {
    const made = new plain_peer(new WebSocket(url, ...how));
    await once(made.socket, "open");
    return made;
  }

  get messages() {
    return this.texts.map((text) => JSON.parse(text));
  }
  send(message) {
    this.socket.send(JSON.stringify(message));
  }
  // The first message, past or to come, for which `wanted` is true.
  first(what, wanted) {
    return until(what, () => this.messages.find(wanted));
  }
  // Sends a call; resolves with its answer.
  call(service, args, message_id) {
    this.send({ service, ...args, message_id });
    return this.first(`the answer to ${message_id}`, ({ in_reply_to }) => in_reply_to === message_id);
  }
  end() {
    return until("the end of the connection", () => this.ended);
  }
}

// Listens; `on_message(message, peer)` for each.
export class plain_server {
  static async start({ on_message, port = 0, ...options } = {}) {
    const made = new plain_server();
    made.peers = [];
    made.server = new WebSocketServer({ host: "127.0.0.1", port, ...options });
    made.server.on("connection", (socket) => {
      const one = new plain_peer(socket);
      if (on_message) one.on_message = (message) => on_message(message, one);
      made.peers.push(one);
    });
    await once(made.server, "listening");
    made.port = made.server.address().port;
    made.url = `ws://127.0.0.1:${made.port}/`;
    return made;
  }

  // The `count`-th peer that came.
  peer(count = 1) {
    return until(`peer number ${count}`, () => this.peers[count - 1]);
  }
  get messages() {
    return this.peers.flatMap(({ messages }) => messages);
  }
  async close() {
    for (const { socket } of this.peers) socket.terminate();
    this.server.close();
    await once(this.server, "close");
  }
}

// SPDX-License-Identifier: Apache-2.0
// A plain rosbridge client over the npm package ws: what anybody would write in ten lines.

import { once } from "node:events";
import { WebSocket } from "ws";
import { until } from "./watchdog.js";

export class rosbridge_client {
  static async connect(url) {
    const made = new rosbridge_client();
    made.received = [];
    made.socket = new WebSocket(url);
    made.socket.on("message", (data) => made.received.push(JSON.parse(data)));
    await once(made.socket, "open");
    return made;
  }

  send(message) {
    this.socket.send(JSON.stringify(message));
  }

  // What came on `topic` so far.
  published(topic) {
    const of_topic = this.received.filter((each) => each.op === "publish" && each.topic === topic);
    return of_topic.map(({ msg }) => msg);
  }

  // The first message, past or to come, for which `wanted` is true.
  first(what, wanted) {
    return until(what, () => this.received.find(wanted));
  }

  close() {
    this.socket.terminate();
  }
}

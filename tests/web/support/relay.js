// SPDX-License-Identifier: Apache-2.0
// A network between a client and a robot that a test can hold and break: TCP, passed on byte by byte.

import { once } from "node:events";
import { connect, createServer } from "node:net";

export class relay {
  // `port`, the robot's, is to be set before anybody connects.
  static async start() {
    const made = new relay();
    Object.assign(made, { port: null, ends: new Set(), held: false });
    made.server = createServer((client) => made.#join(client));
    made.server.listen(0, "127.0.0.1");
    await once(made.server, "listening");
    made.host = `127.0.0.1:${made.server.address().port}`;
    made.url = `ws://${made.host}/`;
    return made;
  }

  #join(client) {
    const robot = connect(this.port, "127.0.0.1");
    for (const [from, to] of [[client, robot], [robot, client]]) {
      this.ends.add(from);
      from.setNoDelay(true);
      from.on("error", () => {});
      from.on("data", (bytes) => to.write(bytes));
      from.on("close", () => (this.ends.delete(from), to.destroy()));
      if (this.held) from.pause();
    }
  }

  // What is sent meanwhile arrives all at once afterwards, as behind a stall of the radio.
  hold() {
    this.held = true;
    for (const end of this.ends) end.pause();
  }
  flow() {
    this.held = false;
    for (const end of this.ends) end.resume();
  }
  cut() {
    for (const end of this.ends) end.destroy();
  }
  end() {
    this.cut();
    this.server.close();
  }
}

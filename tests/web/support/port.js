// SPDX-License-Identifier: Apache-2.0
// A port for a server that goes away and comes back. The kernel gives no such port to anybody meanwhile: not
// to other programs, and not to a client that tries to connect there and would meet itself.

import { once } from "node:events";
import { readFileSync } from "node:fs";
import { createServer } from "node:net";

const given_from = Number(readFileSync("/proc/sys/net/ipv4/ip_local_port_range", "ascii").split(/\s+/)[0]);
const lowest = 10000;

export async function free_port() {
  for (;;) {
    const port = lowest + Math.floor(Math.random() * Math.max(given_from - lowest, 1000));
    const server = createServer();
    const got = await new Promise((done) => {
      server.once("error", () => done(false)).listen(port, "127.0.0.1", () => done(true));
    });
    if (!got) continue;
    server.close();
    await once(server, "close");
    return port;
  }
}

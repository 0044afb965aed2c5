// SPDX-License-Identifier: Apache-2.0
// A server of bench/peers (peers.hpp) on the npm package ws: `npm ci` here installs it. Its documentation's
// advice for speed is followed: bufferutil beside it, no compression, Buffers sent as they came.
import { WebSocketServer } from 'ws';
import { parseArgs } from 'node:util';

const { port, mode } = parseArgs({ options: { port: { type: 'string' }, mode: { type: 'string' } } }).values;
const server = new WebSocketServer({ host: '127.0.0.1', port: Number(port), perMessageDeflate: false });

const handlers = {
  echo: (socket) => (message) => socket.send(message, { binary: false }),
  fan_out: () => (message) => {
    for (const client of server.clients) client.send(message, { binary: false });
  },
  sink: (socket) => {
    let count = 0;
    return (message) => {
      ++count;
      if (message.length === 1) socket.send(String(count));
    };
  },
  // Many at a time, and more when they have been written; in between it looks who has gone away.
  flood: (socket) => (message) => {
    const more = () => {
      if (socket.readyState !== socket.OPEN) return;
      for (let i = 0; i < 200; ++i) socket.send(message, { binary: false });
      socket.send(message, { binary: false }, () => setImmediate(more));
    };
    more();
  },
};

server.on('connection', (socket) => {
  socket.on('error', () => {}); // a client that goes away resets its connection
  socket.on('message', handlers[mode](socket));
});

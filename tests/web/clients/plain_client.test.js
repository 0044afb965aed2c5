// SPDX-License-Identifier: Apache-2.0
// The npm package ws as a client that speaks plain JSON, against rowe_echo, which sends back what it is sent
// and answers each call with itself.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { plain_peer } from "../support/plain.js";
import { program } from "../support/program.js";
import { until } from "../support/watchdog.js";

const limit = { timeout: 120000 };
let server;
let url;

before(async () => {
  server = program.beside_rowe("rowe_echo", "--port", "0");
  [url] = await server.line(/ws:\S+/);
});
after(() => server.end("SIGTERM"));

// Runs `play(peer)` on a connection of its own.
async function with_peer(play, ...how) {
  const peer = await plain_peer.connect(url, ...how);
  try {
    await play(peer);
  } finally {
    peer.socket.terminate();
  }
}
const comes_back = (peer, text) => until(`${text.slice(0, 40)} comes back`, () => peer.texts.includes(text));

test("a message comes back to the byte, and to nobody else", limit, () => with_peer(async (one) => {
  const texts = ['{"x":1.50}', '{ "name" : "\u00e9\u{1f916}\\u0000" }', "{}",
    '{"n":12345678901234567890,"list":[1,[2,{"three":3}]]}', JSON.stringify({ long: "x".repeat(50000) })];
  await with_peer(async (other) => {
    for (const text of texts) one.socket.send(text);
    await comes_back(one, texts.at(-1));
    assert.deepEqual(one.texts, texts);
    other.send({ mine: true });
    await comes_back(other, '{"mine":true}');
    assert.equal(other.texts.length, 1);
  });
}));

test("a call is answered under its own id, string or number", limit, () => with_peer(async (peer) => {
  for (const id of ["m1", "", "\u00e9 / \"quoted\"", 0, 7, -1, 2 ** 53 - 1]) {
    assert.deepEqual(await peer.call("add-two-numbers", { a: 38, b: 4 }, id),
      { service: "add-two-numbers", a: 38, b: 4, in_reply_to: id });
  }
}));

test("calls in flight and messages between them keep apart", limit, () => with_peer(async (peer) => {
  const ids = Array.from({ length: 20 }, (_, i) => `call ${i}`);
  const answers = await Promise.all(ids.map((id, i) => {
    peer.send({ between: i });
    return peer.call("x", { i }, id);
  }));
  assert.deepEqual(answers.map(({ i }) => i), ids.map((_, i) => i));
  await until("all messages are back",
    () => peer.messages.filter(({ between }) => between !== undefined).length === 20);
  assert.equal(peer.texts.length, 40);
}));

test("compression is not chosen, the subprotocol is", limit, async () => {
  await with_peer(async ({ socket }) => {
    assert.equal(socket.extensions, "");
    assert.equal(socket.protocol, "rowe.v1");
  }, ["other", "rowe.v1"], { perMessageDeflate: true });
  await with_peer(async ({ socket }) => assert.equal(socket.protocol, ""));
});

// SPDX-License-Identifier: Apache-2.0
// The npm package ws as a client that speaks plain JSON, against rowe_echo, which sends back what it is sent
// and answers each call with itself.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { plain_peer } from "../support/plain.js";
import { program } from "../support/program.js";
import { until } from "../support/watchdog.js";

const limit = { timeout: 60000 };
let server;
let url;

async function start_echo() {
  const made = program.beside_rowe("rowe_echo", "--port", "0");
  [url] = (await made.line(/ws:\S+/));
  return made;
}

before(async () => (server = await start_echo()));
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

test("fragments are one message, whatever lies between", limit, () => with_peer(async (peer) => {
  const text = Buffer.from('{"name":"\u00e9\u{1f916}"}');
  let pongs = 0;
  peer.socket.on("pong", () => (pongs += 1));
  for (let at = 0; at < text.length; at += 1) {  // through the middle of characters
    peer.socket.send(text.subarray(at, at + 1), { binary: false, fin: at === text.length - 1 });
    if (at % 5 === 0) peer.socket.ping(String(at));
  }
  await comes_back(peer, String(text));
  await until("the pongs", () => pongs >= 1);
}));

test("a ping is answered with what it carried", limit, () => with_peer(async (peer) => {
  for (const carried of ["", "x".repeat(125)]) {
    let answered = null;
    peer.socket.once("pong", (data) => (answered = String(data)));
    peer.socket.ping(carried);
    await until("the pong", () => answered !== null);
    assert.equal(answered, carried);
  }
}));

// Longer than an endpoint waits before it pings (3 s), and before it cuts who is silent (8 s).
test("who only answers pings is not cut", limit, () => with_peer(async (peer) => {
  let pings = 0;
  peer.socket.on("ping", () => (pings += 1));
  const begin = Date.now();
  await until("pings for 9.5 s", () => pings >= 2 && Date.now() - begin > 9500);
  peer.send({ still: "here" });
  await comes_back(peer, '{"still":"here"}');
}));

test("compression is not chosen, the subprotocol is", limit, async () => {
  await with_peer(async ({ socket }) => {
    assert.equal(socket.extensions, "");
    assert.equal(socket.protocol, "rowe.v1");
  }, ["other", "rowe.v1"], { perMessageDeflate: true });
  await with_peer(async ({ socket }) => assert.equal(socket.protocol, ""));
});

test("a close frame is returned with its code", limit, async () => {
  const codes = [[1000, 1000], [1001, 1001], [3000, 3000], [4999, 4999], [undefined, 1000]];
  for (const [given, returned] of codes) {
    await with_peer(async (peer) => {
      peer.send({ last: 1 });
      await comes_back(peer, '{"last":1}');
      peer.socket.close(given, given && "so long");
      assert.equal((await peer.end()).code, returned);
    });
  }
});

test("a server that ends says so", limit, async () => {
  const ours = await plain_peer.connect(url);
  ours.send({ a: 1 });
  await comes_back(ours, '{"a":1}');
  assert.equal(await server.end("SIGTERM"), 0, server.stderr);
  assert.equal((await ours.end()).code, 1001);
  server = await start_echo();
});

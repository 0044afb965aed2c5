// SPDX-License-Identifier: Apache-2.0
// The npm package ws as a server that speaks plain JSON, with rowe's programs as its clients.
import assert from "node:assert/strict";
import { test } from "node:test";
import { plain_server } from "../support/plain.js";
import { program, rowe } from "../support/program.js";
import { until } from "../support/watchdog.js";

const limit = { timeout: 60000 };

// Runs `play(server)` with a server of its own.
async function with_server(options, play) {
  const server = await plain_server.start(options);
  try {
    await play(server);
  } finally {
    await server.close();
  }
}

const add = ({ service, a, b, message_id }, peer) => {
  assert.equal(service, "add-two-numbers");
  peer.send({ result: a + b, in_reply_to: message_id });
};
const paper_call = (url, ...more) =>
  rowe("call", url, "add-two-numbers", '{"a":38,"b":4}', "--plain", ...more);

test("it answers rowe's calls", limit, () => with_server({ on_message: add }, async (server) => {
  const once = await paper_call(server.url);
  assert.deepEqual([once.code, once.stdout], [0, '{"result":42}\n'], once.stderr);
  const often = await paper_call(server.url, "--repeat", "100", "--json");
  assert.deepEqual([often.code, JSON.parse(often.stdout).answered], [0, 100], often.stderr);
  const ids = server.messages.map(({ message_id }) => message_id);
  assert.equal(new Set(ids).size, 101);
  for (const { message_id, ...rest } of server.messages) {
    assert.deepEqual(rest, { service: "add-two-numbers", a: 38, b: 4 });
  }
}));

test("compressing or choosing the subprotocol makes no difference", limit, () => {
  const options = { on_message: add, perMessageDeflate: true, handleProtocols: ([first]) => first ?? false };
  return with_server(options, async (server) => {
    const { code, stdout, stderr } = await paper_call(server.url);
    assert.deepEqual([code, stdout], [0, '{"result":42}\n'], stderr);
    assert.equal(server.peers[0].socket.extensions, "");
  });
});

test("an answer in fragments with pings between is one answer", limit, () => {
  const pongs = [];
  const on_message = ({ message_id }, { socket }) => {
    socket.on("pong", (data) => pongs.push(String(data)));
    const text = Buffer.from(JSON.stringify({ name: "\u00e9\u{1f916}", in_reply_to: message_id }));
    for (let at = 0; at < text.length; at += 1) {
      if (at === 10) socket.ping("in between");
      socket.send(text.subarray(at, at + 1), { binary: false, fin: at === text.length - 1 });
    }
  };
  return with_server({ on_message }, async (server) => {
    const { code, stdout, stderr } = await paper_call(server.url);
    assert.deepEqual([code, JSON.parse(stdout)], [0, { name: "\u00e9\u{1f916}" }], stderr);
    await until("the pong", () => pongs.length > 0);
    assert.deepEqual(pongs, ["in between"]);
  });
});

test("rowe's client closes, and sees that the server does", limit, () => with_server({}, async (server) => {
  const echo = program.rowe("echo", server.url, "--plain", "--json");
  const peer = await server.peer();
  assert.equal(await echo.end("SIGINT"), 130, echo.stderr);  // before any result
  assert.equal((await peer.end()).code, 1001);

  const other = program.rowe("echo", server.url, "--plain", "--json", "-n", "1");
  const leaves = await server.peer(2);
  leaves.socket.close(1001, "back soon");
  assert.equal((await leaves.end()).code, 1001);
  const back = await server.peer(3);  // it comes again by itself
  back.send({ welcome: "back" });
  assert.equal(await other.end(), 0, other.stderr);
  assert.deepEqual(other.lines(), ['{"welcome":"back"}']);
}));

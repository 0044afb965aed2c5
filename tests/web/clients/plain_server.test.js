// SPDX-License-Identifier: Apache-2.0
// The npm package ws as a server that speaks plain JSON, with rowe's programs as its clients.
import assert from "node:assert/strict";
import { test } from "node:test";
import { plain_server } from "../support/plain.js";
import { free_port } from "../support/port.js";
import { program, rowe, until_connected } from "../support/program.js";
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
const fails = ({ code, stdout, stderr }, expected, words) => {
  assert.equal(code, expected, stderr);
  assert.equal(stdout, "");
  assert.match(stderr, words);
};

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

test("unrelated messages and answers to others are not taken for the answer", limit, () => {
  const on_message = (asked, peer) => {
    peer.send({ status: "busy" });
    for (const other of [`${asked.message_id}0`, asked.message_id.slice(0, -1), 7, null]) {
      peer.send({ result: 666, in_reply_to: other });
    }
    add(asked, peer);
    peer.send({ result: 666, in_reply_to: asked.message_id });  // once more
  };
  return with_server({ on_message }, async (server) => {
    const { code, stdout, stderr } = await paper_call(server.url);
    assert.deepEqual([code, stdout], [0, '{"result":42}\n'], stderr);
    assert.equal((await paper_call(server.url, "--repeat", "20")).code, 0);
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

test("a refusal, silence and a lost connection are told apart", limit, async () => {
  const refuse = ({ message_id: in_reply_to }, peer) =>
    peer.send({ error: { code: "refused", text: "not today" }, in_reply_to });
  await with_server({ on_message: refuse }, async ({ url }) =>
    fails(await paper_call(url), 1, /not today/));
  const unknown = ({ message_id: in_reply_to }, peer) =>
    peer.send({ error: { code: "no_service", text: "no such thing" }, in_reply_to });
  await with_server({ on_message: unknown }, async ({ url }) =>
    fails(await paper_call(url), 1, /nobody provides it/));
  await with_server({}, async ({ url }) =>
    fails(await until_connected((time) => paper_call(url, "--timeout", time)), 4, /no answer within/));
  for (const leave of [(socket) => socket.terminate(), (socket) => socket.close(1011, "it broke")]) {
    await with_server({ on_message: (_, { socket }) => leave(socket) }, async ({ url }) =>
      fails(await paper_call(url, "--timeout", "30s"), 1, /went away/));
  }
});

test("what it says is printed, across a restart", limit, async () => {
  let server = await plain_server.start({ port: await free_port() });
  const echo = program.rowe("echo", server.url, "--plain", "--json", "-n", "4");
  const said = ['{"n":1}', '{"n":2.0,"text":"\u00e9"}', '{"n":3}', '{"n":4}'];
  const first = await server.peer();
  for (const text of said.slice(0, 2)) first.socket.send(text);
  await echo.line(/"n":2.0/);
  await server.close();
  server = await plain_server.start({ port: server.port });
  const second = await server.peer();
  for (const text of said.slice(2)) second.socket.send(text);
  assert.equal(await echo.end(), 0, echo.stderr);
  assert.deepEqual(echo.lines(), said);
  await server.close();
});

test("it gets what is published, while it is not too old", limit, async () => {
  await with_server({}, async (server) => {
    const texts = ['{"x":1.50}', '{"name":"\u00e9/\u{1f916}"}'];
    for (const text of texts) {
      const { code, stderr } = await rowe("pub", server.url, text, "--plain", "--once");
      assert.equal(code, 0, stderr);
    }
    await until("both", () => server.messages.length === 2);
    assert.deepEqual(server.peers.flatMap((peer) => peer.texts), texts);
  });

  // Nobody is there in time; then somebody is, who gets what has no end and not what is over.
  const gone = await plain_server.start({ port: await free_port() });
  await gone.close();
  const late = await rowe("pub", gone.url, '{"late":1}', "--plain", "--once", "--ttl", "50ms");
  assert.notEqual(late.code, 0);
  const patient = program.rowe("pub", gone.url, '{"patient":1}', "--plain", "--once", "--ttl", "60s");
  await with_server({ port: gone.port }, async (server) => {
    assert.equal(await patient.end(), 0, patient.stderr);
    await until("what could wait", () => server.messages.length > 0);
    const [{ ttl_ms: left, ...message }, ...more] = server.messages;
    assert.deepEqual([message, more], [{ patient: 1 }, []]);
    assert.ok(left > 0 && left < 60000, `${left} ms are left`);
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

test("rowe_echo_client returns what it says, and answers", limit, () => with_server({}, async (server) => {
  const client = program.beside_rowe("rowe_echo_client", server.url);
  const peer = await server.peer();
  const texts = Array.from({ length: 50 }, (_, i) => `{"i":${i}}`);
  for (const text of texts) peer.socket.send(text);
  await until("all of it", () => peer.texts.length === texts.length);
  assert.deepEqual(peer.texts, texts);
  for (const id of ["m1", 7]) {
    assert.deepEqual(await peer.call("x", { a: 1 }, id), { service: "x", a: 1, in_reply_to: id });
  }
  peer.socket.terminate();
  const again = await server.peer(2);
  again.send({ again: true });
  await until("the echo", () => again.texts.length === 1);
  assert.equal(await client.end("SIGTERM"), 0, client.stderr);
}));

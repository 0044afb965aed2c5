// SPDX-License-Identifier: Apache-2.0
// @foxglove/ws-protocol, unmodified, as Foxglove and Lichtblick use it, against the demo robot.
import assert from "node:assert/strict";
import { test } from "node:test";
import foxglove from "@foxglove/ws-protocol";
import { another, asked, limit, listening, ros, server } from "../support/roslib.js";
import { until } from "../support/watchdog.js";
import { Topic } from "roslib";
import WebSocket from "ws";

const { FoxgloveClient } = foxglove;
const encode = (value) => new TextEncoder().encode(JSON.stringify(value));
const decode = (view) => JSON.parse(new TextDecoder().decode(view));
const capabilities = [
  "clientPublish", "services", "parameters", "parametersSubscribe", "connectionGraph", "time",
];
// What the client was told, by name.
class viewer {
  channels = new Map();
  services = new Map();
  statuses = [];
  messages = [];
  responses = [];
  failures = [];
  errors = [];
  parameters = new Map();
  answers = []; // to requests for parameters
  graph = { publishers: new Map(), subscribers: new Map() };

  static async connect(subprotocol = FoxgloveClient.SUPPORTED_SUBPROTOCOL) {
    const made = new viewer();
    made.socket = new WebSocket(server.url, [subprotocol]);
    made.client = new FoxgloveClient({ ws: made.socket });
    made.client.on("error", (error) => made.errors.push(error));
    made.client.on("serverInfo", (info) => (made.info = info));
    made.client.on("status", (status) => made.statuses.push(status));
    made.client.on("advertise", (all) => all.forEach((one) => made.channels.set(one.topic, one)));
    made.client.on("unadvertise", (ids) => made.channels.forEach((one, topic) => {
      if (ids.includes(one.id)) made.channels.delete(topic);
    }));
    made.client.on("advertiseServices", (all) => all.forEach((one) => made.services.set(one.name, one)));
    made.client.on("message", (message) => made.messages.push(message));
    made.client.on("serviceCallResponse", (response) => made.responses.push(response));
    made.client.on("serviceCallFailure", (failure) => made.failures.push(failure));
    made.client.on("parameterValues", (answer) => {
      if (answer.id !== undefined) made.answers.push(answer);
      for (const { name, value } of answer.parameters) made.parameters.set(name, value);
    });
    made.client.on("connectionGraphUpdate", (update) => made.see(update));
    await until("the server lists what it has", () => made.channels.size > 0 && made.services.size > 0);
    return made;
  }

  // As Foxglove does: what is removed goes last.
  see(update) {
    const { publishers, subscribers } = this.graph;
    for (const { name, publisherIds } of update.publishedTopics) publishers.set(name, publisherIds);
    for (const { name, subscriberIds } of update.subscribedTopics) subscribers.set(name, subscriberIds);
    for (const name of update.removedTopics) {
      publishers.delete(name);
      subscribers.delete(name);
    }
  }

  async call(name, args, callId) {
    const { id } = this.services.get(name);
    const data = new DataView(encode(args).buffer);
    this.client.sendServiceCallRequest({ serviceId: id, callId, encoding: "json", data });
    await until(`${name} answers`, () => [...this.responses, ...this.failures].some((one) =>
      one.callId === callId));
    return this.responses.find((one) => one.callId === callId)
      ?? this.failures.find((one) => one.callId === callId);
  }
}

async function with_viewer(play, ...how) {
  const made = await viewer.connect(...how);
  try {
    await play(made);
    assert.deepEqual(made.errors, []);
  } finally {
    made.socket.terminate();
  }
}

for (const subprotocol of ["foxglove.websocket.v1", "foxglove.sdk.v1"]) {
  test(`${subprotocol} is spoken`, limit, () => with_viewer(async (one) => {
    assert.equal(one.socket.protocol, subprotocol);
    assert.deepEqual(one.info.capabilities, capabilities);
    assert.match(one.info.sessionId, /^\d+$/);
    assert.deepEqual(one.info.supportedEncodings, ["json"]);
  }, subprotocol));
}

// Every value has one type, and is no array in an array: what Foxglove's reader of schemas demands.
function check_schema(schema, at) {
  assert.equal(typeof schema.type, "string", at);
  for (const word of ["anyOf", "oneOf", "allOf", "$ref"]) assert.ok(!(word in schema), at);
  if (schema.type === "array") {
    assert.notEqual(schema.items.type, "array", at);
    check_schema(schema.items, `${at}[]`);
  }
  if (schema.type !== "object") return;
  for (const [name, one] of Object.entries(schema.properties)) check_schema(one, `${at}.${name}`);
}

test("channels have schemas that Foxglove reads", limit, () => with_viewer(async (one) => {
  for (const { topic, encoding, schemaEncoding, schema } of one.channels.values()) {
    assert.equal(encoding, "json");
    assert.equal(schemaEncoding, "jsonschema");
    const parsed = JSON.parse(schema);
    assert.equal(parsed.type, "object");
    check_schema(parsed, topic);
  }
  const odom = one.channels.get("/odom");
  assert.equal(odom.schemaName, "nav_msgs/Odometry");
  const { pose } = JSON.parse(odom.schema).properties;
  assert.equal(pose.properties.pose.properties.position.properties.x.type, "number");
  const { stamp } = JSON.parse(odom.schema).properties.header.properties;
  assert.deepEqual(Object.keys(stamp.properties), ["sec", "nsec"]);
}));

test("messages come with the wall clock's time", limit, () => with_viewer(async (one) => {
  const before_it = BigInt(Date.now() - 5000) * 1000000n;
  const id = one.client.subscribe(one.channels.get("/odom").id);
  await until("20 messages", () => one.messages.length >= 20);
  for (const { subscriptionId, timestamp, data } of one.messages) {
    assert.equal(subscriptionId, id);
    assert.ok(timestamp > before_it && timestamp < BigInt(Date.now() + 5000) * 1000000n);
    const { header, pose } = decode(data);
    assert.ok(Number.isFinite(pose.pose.position.x));
    assert.deepEqual(Object.keys(header.stamp), ["sec", "nsec"]);
  }
  one.client.unsubscribe(id);
  await one.call("/rosapi/topics", {}, 1);
  const heard = one.messages.length;
  await one.call("/rosapi/topics", {}, 2);
  assert.equal(one.messages.length, heard);
}));

test("a service answers, and a call that fails is told so", limit, () => with_viewer(async (one) => {
  const answer = await one.call("/rosapi/topic_type", { topic: "/odom" }, 7);
  assert.equal(answer.encoding, "json");
  assert.deepEqual(decode(answer.data), { type: "nav_msgs/Odometry" });
  one.client.sendServiceCallRequest({
    serviceId: 4000000, callId: 8, encoding: "json", data: new DataView(encode({}).buffer),
  });
  await until("the failure is told", () => one.failures.length === 1);
  assert.equal(one.failures[0].serviceId, 4000000);
  assert.equal(one.failures[0].callId, 8);
  const refused = await one.call("/rosapi/topic_type", [1], 9);
  assert.ok(refused.message.includes("object"), JSON.stringify(refused));
}));

test("what it publishes reaches a page that uses roslib", limit, () => with_viewer(async (one) => {
  const { got: heard } = listening(new Topic({ ros, name: "/from/foxglove", messageType: "a/B" }));
  const channel = one.client.advertise({ topic: "/from/foxglove", encoding: "json", schemaName: "a/B" });
  await until("it arrives", () => {
    one.client.sendMessage(channel, encode({ text: "here" }));
    return heard.length > 0;
  });
  assert.deepEqual(heard[0], { text: "here" });
  one.client.unadvertise(channel);
  one.client.sendMessage(channel, encode({ text: "late" }));
  await until("a status says that the channel is gone", () => one.statuses.length > 0);
  assert.equal(one.statuses[0].level, 2);
}));

test("parameters are got, set, and heard of", limit, () => with_viewer((one) => with_viewer(async (other) => {
  one.client.getParameters([], "all");
  await until("all come", () => one.answers.length === 1);
  assert.equal(one.answers[0].id, "all");
  assert.equal(one.parameters.get("/robot/speed_max"), 1);
  assert.ok(one.parameters.get("/rowe/limits/topics_max") > 0);
  assert.ok(one.parameters.get("/rowe/counters/messages_in") > 0);
  // As Foxglove does: by all the names that it was told.
  one.client.subscribeParameterUpdates([...one.parameters.keys()]);
  other.client.setParameters([{ name: "/robot/speed_max", value: 0.25 }], "set");
  await until("who set it is answered", () => other.answers.length === 1);
  assert.deepEqual(other.answers[0], {
    op: "parameterValues", id: "set",
    parameters: [{ name: "/robot/speed_max", value: 0.25, type: "float64" }],
  });
  await until("who subscribed hears of it", () => one.parameters.get("/robot/speed_max") === 0.25);
})));

test("the connection graph is told whole, and as it changes", limit, () => with_viewer(async (one) => {
  const { publishers, subscribers } = one.graph;
  one.client.subscribeConnectionGraph();
  await until("it is told", () => publishers.has("/odom"));
  const [robot_node] = publishers.get("/odom");
  assert.deepEqual(publishers.get("/rowe/stats"), [robot_node]);

  const watching = await another();
  const nodes = () => asked((...callbacks) => watching.getNodes(...callbacks));
  assert.ok((await nodes()).includes(robot_node));
  const topic = new Topic({ ros: watching, name: "/of/a/page", messageType: "a/B" });
  topic.advertise();
  await until("a publisher has come", () => publishers.get("/of/a/page")?.length === 1);
  const [page] = publishers.get("/of/a/page");
  assert.notEqual(page, robot_node);
  assert.ok((await nodes()).includes(page));
  topic.subscribe(() => {});
  await until("a subscriber has come", () => subscribers.get("/of/a/page")?.includes(page));
  watching.close();
  await until("the topic has gone", () => !publishers.has("/of/a/page") && !subscribers.has("/of/a/page"));
}));

test("its call of /rowe/stop stops the robot", limit, () => with_viewer(async (one) => {
  assert.equal(one.services.get("/rowe/stop").id, 1);
  const answer = await one.call("/rowe/stop", { source: "foxglove" }, 3);
  assert.equal(decode(answer.data).state, "stopped");
}));

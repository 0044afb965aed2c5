// SPDX-License-Identifier: Apache-2.0
// roslib in Node: it listens for the exact name that it subscribed by, and writes types as either ROS does.
import assert from "node:assert/strict";
import { test } from "node:test";
import { another, limit, listening, with_statuses } from "../support/roslib.js";
import { until } from "../support/watchdog.js";
import { Topic } from "roslib";

const connected = async () => with_statuses(await another());
const listening_to = (ros, name, messageType) => listening(new Topic({ ros, name, messageType }));

test("topics are one by either name, and each is heard by its own", limit, async () => {
  const [one, other, speaker] = [await connected(), await connected(), await connected()];
  const topics = [listening_to(one, "/spelt", "std_msgs/String"),
    listening_to(other, "spelt", "std_msgs/msg/String")];
  // One page that uses both names has a callback for each.
  for (const name of ["/spelt", "spelt"]) topics.push(listening_to(speaker, name, "std_msgs/String"));
  const said = [new Topic({ ros: speaker, name: "/spelt", messageType: "std_msgs/msg/String" }),
    new Topic({ ros: speaker, name: "spelt", messageType: "std_msgs/String" })];
  for (const [i, topic] of said.entries()) {
    // Again and again, since a message may overtake the other connections' subscriptions.
    await until("everybody hears it", () => {
      topic.publish({ data: i });
      return topics.every(({ got }) => got.some(({ data }) => data === i));
    });
  }
  topics[0].unsubscribe();
  topics[2].unsubscribe();
  // Its own subscription by the other name goes on.
  const before = topics[3].got.length;
  await until("the other name is still heard", () => {
    said[0].publish({ data: "late" });
    return topics[3].got.length > before && topics[1].got.some(({ data }) => data === "late");
  });
  assert.ok(!topics[2].got.some(({ data }) => data === "late"));
  for (const ros of [one, other, speaker]) {
    assert.deepEqual(ros.statuses, []);
    ros.close();
  }
});

test("a page that expects another type is told", limit, async () => {
  const ros = await connected();
  listening_to(ros, "/odom", "nav_msgs/msg/Odometry");
  const wrong = listening_to(ros, "odom", "std_msgs/String");
  await until("it is told", () => ros.statuses.length > 0);
  assert.equal(ros.statuses.length, 1);
  assert.equal(ros.statuses[0].msg,
    "subscribe /odom: the topic has the type nav_msgs/Odometry, not std_msgs/String");
  await until("its messages come", () => wrong.got.length > 0);
  ros.close();
});

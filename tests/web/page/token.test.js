// SPDX-License-Identifier: Apache-2.0
// Where the page's token comes from, where it is kept, and what it is shown to.
import assert from "node:assert/strict";
import { beforeEach, test } from "node:test";
import { load } from "./load.js";

const { is_known, token } = await load("token.js");

let kept, place, trail;
const storage = {
  getItem: (name) => kept.get(name) ?? null,
  setItem: (name, value) => kept.set(name, value),
  removeItem: (name) => kept.delete(name),
};
const made = () => new token(storage, place, trail);

beforeEach(() => {
  kept = new Map();
  place = { hash: "", pathname: "/", search: "" };
  trail = { shown: null, replaceState: (_state, _title, url) => (trail.shown = url) };
});

test("without a token nothing is offered", () => {
  const who = made();
  assert.deepEqual(who.subprotocols, []);
  assert.deepEqual(who.headers, {});
  assert.equal(trail.shown, null);
});

test("what no robot has as a token, and no socket can offer, is none", () => {
  for (const odd of ["abc)", "a=b", "abc/", "a b", "\u00fc", "x".repeat(129), ""]) {
    kept.set("rowe.token", odd);
    const who = made();
    assert.deepEqual([who.set(odd), who.value, kept.has("rowe.token")], [false, "", false]);
    assert.deepEqual(who.subprotocols, []);
  }
  assert.equal(made().set(" good-one_.~ "), true);
});

test("the fragment's token is taken out of the address, and kept for the tab", () => {
  place.hash = "#token=0123456789abcdef";
  const who = made();
  assert.deepEqual(who.subprotocols, ["rowe.v1", "rowe.token.0123456789abcdef"]);
  assert.deepEqual(who.headers, { Authorization: "Bearer 0123456789abcdef" });
  assert.equal(trail.shown, "/");
  place.hash = "";
  assert.equal(made().value, "0123456789abcdef");
});

test("a fragment that names a topic is left alone", () => {
  place.hash = "#/odom";
  assert.equal(made().value, "");
  assert.equal(trail.shown, null);
});

test("what is typed is trimmed, and what the robot does not know is forgotten", () => {
  const who = made();
  who.set(" abcdefghijklmnop \n");
  assert.equal(who.value, "abcdefghijklmnop");
  who.forget();
  assert.deepEqual(who.subprotocols, []);
  assert.equal(made().value, "");
});

test("the robot is asked with the token, and says by 401 or 429 that it does not know it", async () => {
  const who = made();
  who.set("abcdefghijklmnop");
  const asked = [];
  const answering = (status) => async (path, { method, headers }) => {
    asked.push([path, method, headers]);
    return { status };
  };
  assert.equal(await is_known(who, answering(401)), false);
  assert.equal(await is_known(who, answering(429)), false);
  assert.equal(await is_known(who, answering(403)), true);
  assert.equal(await is_known(who, answering(200)), true);
  assert.equal(await is_known(who, async () => { throw new TypeError("no network"); }), null);
  assert.deepEqual(asked[0], ["/metrics", "HEAD", { Authorization: "Bearer abcdefghijklmnop" }]);
});

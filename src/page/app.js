// SPDX-License-Identifier: Apache-2.0
// The page of an endpoint: subscribes to one topic of poses and to the endpoint's statistics over the port
// that served it, and shows both. Three clocks drive it: messages as they come only update what is
// remembered; the canvas is drawn by animation frames, hence not at all while the page is hidden; words are
// written ten times a second.
//
// Whether the robot is alive is judged by the age of its last pose, never by the socket: a loop that died
// behind an endpoint that still answers must not look alive.

import { kept_link, link, moment, since_ms } from "./link.js";
import { path_view } from "./path.js";
import { is_pose_type, pose_of } from "./pose.js";
import { loss_table, rate_table, real_time_words, write } from "./stats.js";
import { stop } from "./stop.js";
import { stop_panel } from "./stop_panel.js";
import { fixed, latch, losses, metres, states, text, thinned } from "./text.js";
import { is_known, token } from "./token.js";

const default_topic = "/odom";
const stats_topic = "/rowe/stats";
const throttle_ms = 33;
const stale_ms = Math.max(500, 3 * throttle_ms);
const stats_stale_ms = 1500;
const words_ms = 100;
const age_ms_step = 300;       // the age of what is live is written anew only so often: it must be readable
const look_ms_max = 3000;      // a topic of unknown type is looked at for so long …
const look_bytes_max = 4096;   // … if its messages are this small …
const looks_max = 64;          // … and not more of them than this

const element = (id) => document.getElementById(id);
const still = matchMedia("(prefers-reduced-motion: reduce)");

const who = new token(sessionStorage, location, history); // first: it takes its part of the address

const seen = {
  topic: topic_of_hash() ?? default_topic,
  pose: null,        // the last one, kept when the connection goes
  pose_at: null,     // when its frame came; null until one came for this topic
  stats: null,
  stats_at: null,
  looking: null,     // {topic, at}: the subscription that finds out what a topic holds
  looked: new Map(), // topic → whether it holds poses
  pose_written: false,
  stats_written: false,
  age_written: 0,
};

const view = new path_view(element("path"), text, still.matches);
const rates = new rate_table(element("rates"));
const lost = [new loss_table(element("losses"), losses), new loss_table(element("thinned"), thinned)];
const protocol = location.protocol === "https:" ? "wss:" : "ws:";
const robot = new link(`${protocol}//${location.host}/`, { opened, received, refused },
  () => who.subprotocols);
// Where places are kept for the stop.
const kept = new kept_link(`${protocol}//${location.host}/rowe/stop`, robot, {
  opened: () => robot.state !== "open" && brake.opened(),
  received: (message) => brake.received(message),
}, () => who.subprotocols);
const brake = new stop(robot, `page-${Math.random().toString(36).slice(2, 6)}`, kept);
const panel = new stop_panel(brake);

function topic_of_hash() {
  try {
    return decodeURIComponent(location.hash.slice(1)) || null;
  } catch {
    return null;  // half an escape
  }
}

// --- messages ----------------------------------------------------------------------------------------------

function subscribe(topic, id, throttle_rate) {
  robot.send({ op: "subscribe", id, topic, throttle_rate, queue_length: 1 });
}

function opened() {
  element("who").hidden = true;
  seen.looking = null;
  seen.stats_at = null;
  brake.opened();
  subscribe(stats_topic, "stats", 100);
  subscribe(seen.topic, "pose", throttle_ms);
}

// The robot may want a token, or another one. The links go on, without one.
async function refused() {
  const shown = who.value;
  if (await is_known(who) !== false || robot.state === "open" || who.value !== shown) return;
  // Without a token they are refused again: what was said of the one before still holds.
  if (shown || element("who").hidden)
    element("who_says").textContent = shown ? text.token_unknown : text.token_wanted;
  who.forget();
  element("who").hidden = false;
}

function introduce(event) {
  event.preventDefault();
  who.set(element("token").value);
  element("token").value = "";
  robot.turn(true);
  kept.turn(true);
}

function received(message) {
  brake.received(message);
  if (message.op === "status") {
    element("note").textContent = text.says(String(message.msg));
    element("note").hidden = message.level !== "error" && message.level !== "warning";
  } else if (message.op === "publish") {
    if (message.topic === seen.topic) take_pose(message.msg);
    if (message.topic === stats_topic) take_stats(message.msg);
    if (message.topic === seen.looking?.topic) end_look(pose_of(message.msg) !== null);
  }
}

function take_pose(message) {
  const missed = seen.pose_at === null || since_ms(seen.pose_at) > stale_ms;
  seen.pose = pose_of(message);
  seen.pose_at = moment();
  seen.pose_written = false;
  if (seen.pose) view.add(seen.pose, missed);
}

function take_stats(message) {
  if (message === null || typeof message !== "object") return;
  const topics = Array.isArray(message.topics) ? message.topics : [];
  seen.stats = { ...message, topics: topics.filter((entry) => typeof entry?.topic === "string") };
  seen.stats_at = moment();
  seen.stats_written = false;
  if (topic_of_hash() === null && !drawable(seen.topic)) {
    const other = seen.stats.topics.find((entry) => drawable(entry.topic));
    if (other) select(other.topic);
  }
  look();
}

// --- topics ------------------------------------------------------------------------------------------------

// Whether a topic is known to hold poses. The one that was asked for is, once a pose came.
function drawable(topic) {
  if (topic === seen.topic && seen.pose) return true;
  const told = seen.stats?.topics.find((entry) => entry.topic === topic);
  return seen.looked.get(topic) ?? is_pose_type(told?.type);
}

// Looks into one topic of unknown type at a time, for one message.
function look() {
  if (seen.looking && since_ms(seen.looking.at) > look_ms_max) end_look(false);
  if (seen.looking || seen.looked.size >= looks_max) return;
  const next = seen.stats.topics.find(
    ({ topic, type, bytes, messages }) =>
      topic !== seen.topic && !topic.startsWith("/rowe/") && !is_pose_type(type) && messages > 0 &&
      bytes <= look_bytes_max && !seen.looked.has(topic),
  );
  if (!next) return;
  seen.looking = { topic: next.topic, at: moment() };
  subscribe(next.topic, "look", 1000);
}

function end_look(found) {
  robot.send({ op: "unsubscribe", id: "look", topic: seen.looking.topic });
  seen.looked.set(seen.looking.topic, found);
  seen.looking = null;
}

// Shows another topic's path, from now on.
function select(topic) {
  if (topic === seen.topic) return;
  robot.send({ op: "unsubscribe", id: "pose", topic: seen.topic });
  Object.assign(seen, { topic, pose: null, pose_at: null, pose_written: false });
  view.clear();
  subscribe(topic, "pose", throttle_ms);
}

function write_choice() {
  const topics = new Set([seen.topic]);
  for (const { topic } of seen.stats?.topics ?? []) if (drawable(topic)) topics.add(topic);
  const listed = [...topics].sort();
  const choice = element("topic");
  if (listed.join() !== [...choice.options].map((option) => option.value).join()) {
    choice.replaceChildren(...listed.map((topic) => new Option(topic, topic)));
  }
  if (choice.value !== seen.topic) choice.value = seen.topic;
  choice.disabled = listed.length < 2;
}

// --- words -------------------------------------------------------------------------------------------------

// The one state shown, and what its sentence needs.
function judge() {
  const { topic } = seen;
  if (robot.state === "connecting") return { name: "connecting" };
  if (robot.state !== "open") return { name: "disconnected", retry_in_ms: robot.retry_in_ms };
  if (seen.pose_at === null) return { name: "waiting", topic };
  const age_ms = since_ms(seen.pose_at);
  return { name: age_ms > stale_ms ? "stale" : "live", age_ms };
}

function write_state() {
  const state = judge();
  const { mark, word, sentence } = states[state.name];
  const name = seen.stats?.name || location.hostname;
  const changed = document.body.dataset.state !== state.name;
  const now = performance.now();
  if (changed || state.name !== "live" || now - seen.age_written >= age_ms_step) {
    seen.age_written = now;
    write(element("state"), sentence(state));
  }
  write(element("mark"), mark);
  write(element("name"), name);
  const shown = panel.stopped ? latch.stopped : { mark, word };
  write(document.querySelector("title"), text.title(shown.mark, name, shown.word));
  panel.show(name);
  write_about(state.name);
  if (!changed) return;
  document.body.dataset.state = state.name;
  element("spoken").textContent = `${name} ${word}`;
  element("veil").textContent = state.name === "live" ? "" : word;
  view.recolour();
}

// The quiet lines of the bar: why nothing is seen, or else what the endpoint says of itself.
function write_about(state) {
  const answers = seen.stats_at !== null && since_ms(seen.stats_at) < stats_stale_ms;
  document.body.dataset.stats = answers || !seen.stats ? "live" : "stale";
  write(element("uptime"), answers ? text.uptime(seen.stats.uptime_s, seen.stats.peers) : "");
  const about = {
    stale: answers ? text.silent_topic(seen.topic) : text.silent,
    disconnected: seen.pose ? text.known : "",
  };
  write(element("about"), about[state] ?? real_time_words(seen.stats?.real_time));
}

function write_pose() {
  if (seen.pose_written) return;
  seen.pose_written = true;
  const { x, y, z, heading, speed, turn } = seen.pose ?? {};
  const words = {
    x: metres(x), y: metres(y), z: metres(z),
    heading: fixed((heading * 180) / Math.PI, 1), speed: fixed(speed, 3), turn: fixed(turn, 3),
  };
  for (const [id, value] of Object.entries(words)) write(element(id), value);
}

function write_stats() {
  const { stats } = seen;
  if (!stats || seen.stats_written) return;
  seen.stats_written = true;
  const at = typeof stats.uptime_s === "number" ? stats.uptime_s : performance.now() / 1000;
  rates.show(stats.topics, at, seen.topic, (entry) => drawable(entry.topic));
  for (const group of lost) group.show(stats.losses ?? {}, at);
  write_choice();
}

function write_follow() {
  element("follow").setAttribute("aria-pressed", String(view.following));
}

// --- clocks and hands --------------------------------------------------------------------------------------

function tick() {
  robot.turn();
  kept.turn();
  brake.turn();
  write_state();
  write_pose();
  write_stats();
}

function draw(now) {
  view.draw(now);
  requestAnimationFrame(draw);
}

function toggle_follow() {
  view.follow(!view.following);
  write_follow();
}

for (const each of document.querySelectorAll("[data-text]")) each.textContent = text[each.dataset.text];
for (const each of document.querySelectorAll("[data-label]")) each.ariaLabel = text[each.dataset.label];
element("follow").onclick = element("path").onclick = toggle_follow;
element("topic").onchange = (event) => (location.hash = encodeURI(event.target.value));
element("who").onsubmit = introduce;
addEventListener("hashchange", () => {
  if (who.take_fragment()) robot.turn(true);
  else select(topic_of_hash() ?? default_topic);
});
addEventListener("online", () => robot.turn(true));
document.addEventListener("visibilitychange", () => document.hidden ? brake.hide() : robot.turn(true));
addEventListener("pagehide", () => brake.hide());
matchMedia("(prefers-color-scheme: dark)").onchange = () => view.recolour();
still.onchange = () => (view.still = still.matches);

write_choice();
write_follow();
for (const group of lost) group.show({}, 0);
setInterval(tick, words_ms);
tick();
requestAnimationFrame(draw);

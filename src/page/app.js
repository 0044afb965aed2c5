// SPDX-License-Identifier: Apache-2.0
// The page of an endpoint. Three clocks drive it: messages as they come only update what is remembered; the
// canvas is drawn by animation frames, hence not at all while the page is hidden; words are written ten times
// a second.

import { read, remember, remembered, written } from "./arranged.js";
import { bar } from "./bar.js";
import { moment, since_ms } from "../../clients/js/src/link.js";
import { connect } from "../../clients/js/src/rowe.js";
import { data_view } from "./data_view.js";
import { choose_from, element, mark, write } from "./dom.js";
import { drive_panel } from "./drive_panel.js";
import { take_files } from "./drop.js";
import { feeds, live_source } from "./feeds.js";
import { map_hands } from "./map_hands.js";
import { clock, day, fixed, metres } from "./numbers.js";
import { path_view } from "./path.js";
import { plot_view } from "./plot_view.js";
import { pose_of } from "./pose.js";
import { pose_topics } from "./pose_topics.js";
import { rights } from "./rights.js";
import { sights } from "./sights.js";
import { stop_panel } from "./stop_panel.js";
import { latch, text } from "./text.js";
import { is_known, token } from "./token.js";
import { judge, robot_clock, usual_age } from "./truth.js";

const default_topic = "/odom";
const stats_hz = 10;          // where numbers are shown …
const stats_hz_unseen = 2;    // … and elsewhere, for the list of topics
const pose_hz = 30;           // where the path is seen …
const pose_hz_unseen = 5;     // … and elsewhere, for the bar
const path_ms = 60000;        // of what was driven before, where it is known
const stats_stale_ms = 1500;
const parameters_hz = 2;
const words_ms = 100;
const note_ms = 15000;

const still = matchMedia("(prefers-reduced-motion: reduce)");
const views = ["overview", "drive", "plot", "data"];

const who = new token(sessionStorage, location, history); // first: it takes its part of the address
const named = `page-${Math.random().toString(36).slice(2, 6)}`;
const robot = connect(location.origin, { name: named, token: () => who.value });
const time = new robot_clock(robot);
const live = new live_source(robot, time);
const asked = new feeds(live, document);   // what is shown: of the robot, or of a recording
const always = new feeds(live, document);  // what is the robot's in any case
const allowed = new rights(robot);
const panel = new stop_panel(robot, allowed, time);
const top_bar = new bar();
const poses = new pose_topics(asked);
const view = new path_view(element("path"), text, still.matches);
const seen_by_robot = new sights(asked, view);
const plots = new plot_view(robot, asked);
const data = new data_view(robot, asked, plots, allowed);

const seen = {
  pose: null,        // the last one, kept when the connection goes
  heard: null,       // when that came, by the clock here
  told_ms: null,     // … and by the time of the source
  gaps: new usual_age(),
  noted: null,       // when the robot reported what is shown
  pose_written: false,
  stats: null,
  stats_written: false,
  state: "blank",
};
let shown = { view: "overview", topic: null };
let opened = null;   // the recording that is shown, or is being opened
let recorded = null; // … once it is shown
const want_pose = (topic) => asked.want(topic, take_pose, pose_hz, { past_ms: path_ms, jumped: forget_pose });
let pose_feed = want_pose(default_topic);
const stats_feed = asked.want("/rowe/stats", take_stats, stats_hz, { listing: true });
const drive = new drive_panel(robot, allowed, always, keeps);
panel.driving = () => drive.drives;
panel.alone = () => recorded === null;
data.asks = () => recorded === null;
always.want("/rowe/parameters", ({ values }) => take_parameters(values ?? {}), parameters_hz);

// What is shown goes into the address, and is remembered for the next time.
function note_arranged() {
  const fragment = written({ ...shown, ...drive.arranged, ...plots.arranged, ...seen_by_robot.arranged });
  const { pathname, search } = location;
  history.replaceState(null, "", fragment || pathname + search);
  remember(() => localStorage, fragment);
}

function arrange(all) {
  const view_of = recorded && all.view === "drive" ? "overview" : all.view;  // nobody drives by a recording
  shown = { view: view_of, topic: all.topic };
  look_at(shown.topic ?? default_topic);
  show_view();
  drive.arrange(all);
  plots.arrange(all);
  seen_by_robot.arrange(all);
}

// --- who this is -------------------------------------------------------------------------------------------

// The robot may want a token, or another one. The page goes on trying to connect, without one.
async function refused() {
  const shown_one = who.value;
  if (await is_known(who) !== false || robot.state === "open" || who.value !== shown_one) return;
  // Without a token it is refused again: what was said of the one before still holds.
  if (shown_one || element("who").hidden)
    element("who_says").textContent = shown_one ? text.token_unknown : text.token_wanted;
  who.forget();
  element("who").hidden = false;
}

function introduce(event) {
  event.preventDefault();
  const may = who.set(element("token").value);
  element("token").value = "";
  if (!may) element("who_says").textContent = text.token_unknown;
  robot.link.turn(true);
}

// --- messages ----------------------------------------------------------------------------------------------

function take_pose(message) {
  const told_ms = pose_feed.at_ms;
  const gap_ms = seen.heard === null ? Infinity
    : asked.knows_past ? told_ms - seen.told_ms : since_ms(seen.heard);
  seen.told_ms = told_ms;
  const missed = gap_ms > stale_ms();
  seen.gaps.came(gap_ms);
  seen.pose = pose_of(message);
  seen.heard = moment();
  seen.pose_written = false;
  if (!seen.pose) return;
  poses.found(pose_feed.topic);
  view.add(seen.pose, missed);
}

function take_stats(message) {
  if (message === null || typeof message !== "object") return;
  const topics = Array.isArray(message.topics) ? message.topics : [];
  // Another life of the robot: where it had been is not where it is.
  if (seen.stats?.epoch !== undefined && message.epoch !== seen.stats.epoch) view.clear();
  seen.stats = { ...message, topics: topics.filter((entry) => typeof entry?.topic === "string") };
  seen.stats_written = false;
  mark(document.body, "data-told", message.unknown !== true);
  poses.take(seen.stats.topics);
  if (!recorded) drive.listed(seen.stats.topics);
  seen_by_robot.take(seen.stats.topics);
  if (shown.topic === null && !poses.has(pose_feed.topic)) {
    const [other] = poses.all;
    if (other) look_at(other);
  }
}

// What the robot's statistics say of a topic.
const entry_of = (topic) => seen.stats?.topics.find((entry) => entry.topic === topic);

function take_parameters(values) {
  data.parameters.take(values);
  const named = Object.entries(values).filter(([name]) => /(^|\/)speed_max$/.test(name));
  const [fastest] = named.sort(([one], [other]) => one.length - other.length);
  if (fastest) drive.fastest(fastest[1]);
}

function take_status({ level, msg }) {
  if (level !== "error" && level !== "warning") return;
  say_note(text.says(String(msg)));
}
function say_note(words) {
  seen.noted = moment();
  element("note").textContent = words;
  element("note").hidden = false;
}
function end_note() {
  seen.noted = null;
  element("note").hidden = true;
}

// --- what is shown -----------------------------------------------------------------------------------------

// Shows another topic's path, from now on.
function look_at(topic) {
  if (topic === pose_feed.topic) return;
  pose_feed.end();
  forget_pose();
  pose_feed = want_pose(topic);
}

function forget_pose() {
  Object.assign(seen, { pose: null, heard: null, told_ms: null, gaps: new usual_age(), pose_written: false });
  view.clear();
}

function show_view() {
  document.body.dataset.view = shown.view;
  for (const each of views) {
    const button = element(`view_${each}`);
    if (each === shown.view) button.setAttribute("aria-current", "page");
    else button.removeAttribute("aria-current");
  }
  pose_feed.at(shown.view === "data" || shown.view === "plot" ? pose_hz_unseen : pose_hz);
  stats_feed.at(shown.view === "data" ? stats_hz : stats_hz_unseen);
  plots.visible(shown.view === "plot");
  seen_by_robot.visible(shown.view);
  data.visible(shown.view === "data");
  seen.stats_written = false;
}

function go(to) {
  shown = { ...shown, ...to };
  show_view();
  note_arranged();
}

function keeps() {
  const { state, heard } = seen;
  if (recorded) return "recording";
  if (state === "live" || (state === "waiting" && heard === null)) return panel.keeps;
  return state === "blank" ? "connecting" : state === "waiting" ? "stale" : state;
}

// --- words -------------------------------------------------------------------------------------------------

const stale_ms = () => seen.gaps.stale_ms(pose_feed.hz, entry_of(pose_feed.topic)?.rate_hz);

// Nothing of the robot stands in the bar while a recording is shown.
function write_recorded() {
  seen.state = "recording";
  document.body.dataset.stats = "live";
  const { now_ms } = recorded.source;
  const changed = top_bar.show("recording", {
    name: recorded.name, age_ms: NaN, stopped: recorded.stopped,
    recorded: text.recorded_at(day(now_ms), clock(now_ms), recorded.robot),
  }, null);
  if (changed) view.recolour();
}

function write_state() {
  if (robot.state === "open") element("who").hidden = true;
  if (recorded) return write_recorded();
  seen.state = judge(robot.state, pose_feed, stale_ms(), seen.heard !== null);
  const { stats, heard } = seen;
  const answers = stats !== null && stats_feed.fresh(stats_stale_ms);
  document.body.dataset.stats = answers || !stats ? "live" : "stale";
  const changed = top_bar.show(seen.state, {
    topic: pose_feed.topic,
    age_ms: heard === null ? NaN : since_ms(heard),
    heard_at: heard === null ? "" : clock(time.at(heard.calendar)),
    retry_in_ms: robot.retry_in_ms,
    answers,
    name: stats?.name || location.hostname,
    clock_ms: time.ahead_ms === null ? null : time.at(Date.now()),
    uptime: answers ? text.uptime(stats.uptime_s, stats.peers) : "",
    driver: drive.drives ? text.you_drive : drive.driver ? text.drives(drive.driver) : "",
  }, panel.stopped ? { sign: latch.stopped.sign, word: text.stopped } : null);
  if (changed) view.recolour();
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

function write_choice() {
  choose_from(element("topic"), [...new Set([pose_feed.topic, ...poses.all])].sort(), pose_feed.topic);
}

function write_stats() {
  const { stats } = seen;
  if (!stats || seen.stats_written) return;
  seen.stats_written = true;
  const at = typeof stats.uptime_s === "number" ? stats.uptime_s : performance.now() / 1000;
  if (shown.view === "data") data.show(stats, at);
  write_choice();
}

// --- recordings --------------------------------------------------------------------------------------------

async function open_recording(file) {
  leave_recording();
  try {
    const { recording } = await import("./recording.js").catch(() => {
      throw new Error(text.not_loaded);
    });
    const made = new recording(file, leave_recording);
    opened = made;
    const source = await made.opened;
    if (opened === made) show_recording(made, source);
  } catch ({ message }) {
    if (opened && opened.name !== file.name) return;
    leave_recording();
    say_note(text.not_opened(file.name, message));
  }
}

function show_recording(made, source) {
  recorded = made;
  drive.off(true);
  if (shown.view === "drive") go({ view: "overview" });
  show_from(source);
}

function leave_recording() {
  opened?.end();
  opened = null;
  if (!recorded) return;
  recorded = null;
  drive.off(false);
  show_from(live);
}

// What is shown from now on has nothing to do with what was shown.
function show_from(source) {
  poses.clear();
  seen.stats = null;
  end_note();
  look_at(shown.topic ?? default_topic);
  asked.from(source);
  seen_by_robot.take([]);
  write_choice();
  write_state();
}

// --- clocks and hands --------------------------------------------------------------------------------------

function tick() {
  if (!document.hidden) time.turn();
  if (seen.noted && since_ms(seen.noted) > note_ms) end_note();
  write_state();
  panel.show();
  drive.show();
  element("view_drive").hidden = !drive.offered;
  write_pose();
  write_stats();
  data.turn();
  plots.turn();
  seen_by_robot.turn();
}

function draw(now) {
  requestAnimationFrame(draw);  // first: what cannot be drawn does not end the drawing
  view.draw(now);
}

for (const each of document.querySelectorAll("[data-text]")) each.textContent = text[each.dataset.text];
for (const each of document.querySelectorAll("[data-hint]")) each.placeholder = text[each.dataset.hint];
for (const each of document.querySelectorAll("[data-label]")) each.ariaLabel = text[each.dataset.label];
robot.on("refused", refused);
robot.on("closed", refused);
robot.on("status", take_status);
robot.on("open", end_note);
for (const each of views) element(`view_${each}`).onclick = () => go({ view: each });
element("find_topic").oninput = () => (seen.stats_written = false);
element("topic").onchange = ({ target }) => {
  go({ topic: target.value });
  look_at(target.value);
};
element("who").onsubmit = introduce;
take_files(open_recording);
addEventListener("hashchange", () => {
  if (who.take_fragment()) return robot.link.turn(true);
  arrange(read(location.hash, views));
});
matchMedia("(prefers-color-scheme: dark)").onchange = () => view.recolour();
still.onchange = () => (view.still = still.matches);
new map_hands(element("path"), view);

allowed.changed = () => data.rights_changed();
drive.changed = note_arranged;
plots.changed = note_arranged;
seen_by_robot.changed = note_arranged;
arrange(read(location.hash || remembered(() => localStorage), views));
note_arranged();
write_choice();
setInterval(tick, words_ms);
tick();
requestAnimationFrame(draw);

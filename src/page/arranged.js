// SPDX-License-Identifier: Apache-2.0
// What a person arranged, as words that the address carries and this browser remembers for this address:
// #view=plot&topic=/gps&drive=/cmd_vel&plot=/gps:pose.x,/power:volts&span=60&camera=/front&front=map. A topic
// alone, #/gps, is read as well. Speeds are not part of it: nobody drives faster by following a link.

const remembered_as = "rowe.arranged";
const usual = {
  view: "overview", topic: null, drive: null, plot: [], span: null, camera: null, front: null,
};

// All of it, from the fragment of an address; what is not said is as usual.
export function read(hash, views) {
  const said = hash.slice(1);
  if (said.startsWith("/")) {
    try {
      return { ...usual, topic: decodeURIComponent(said) };
    } catch {
      return { ...usual };  // half an escape
    }
  }
  const at = new URLSearchParams(said);
  const view = views.includes(at.get("view")) ? at.get("view") : usual.view;
  const front = ["map", "camera"].includes(at.get("front")) ? at.get("front") : null;
  const span = Number(at.get("span")) || null;
  const plot = at.get("plot")?.split(",") ?? [];
  const [topic, drive, camera] = ["topic", "drive", "camera"].map((name) => at.get(name));
  return { view, topic, drive, plot, span, camera, front };
}

// The fragment that says it; empty: all as usual.
export function written(arranged) {
  const spelt = (value) => encodeURIComponent(value).replace(/%(2F|3A|2C)/g, decodeURIComponent);
  const said = Object.entries({ ...arranged, plot: arranged.plot.join() })
    .filter(([name, value]) => value && value !== usual[name])
    .map(([name, value]) => `${name}=${spelt(value)}`);
  return said.length > 0 ? `#${said.join("&")}` : "";
}

// Browsers may forbid to remember anything; then a page begins as usual.
export function remember(storage, fragment) {
  try {
    storage().setItem(remembered_as, fragment);
  } catch {
    return;
  }
}
export function remembered(storage) {
  try {
    return storage().getItem(remembered_as) ?? "";
  } catch {
    return "";
  }
}

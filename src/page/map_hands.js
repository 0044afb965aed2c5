// SPDX-License-Identifier: Apache-2.0
// The hands on the map: two buttons and the wheel zoom, a finger or the mouse moves what is seen, and one
// button follows the robot.

import { element, mark } from "./dom.js";

const step = 1.5;
const wheel_step = 1.0015;

export class map_hands {
  #fingers = new Map();  // of pointers that are down, by their id

  constructor(canvas, view) {
    const follow = element("follow");
    const written = () => mark(follow, "aria-pressed", view.mode === "follow");
    const zoom = (times) => {
      view.zoom(times);
      written();
    };
    follow.onclick = () => {
      view.follow(view.mode !== "follow");
      written();
    };
    element("zoom_in").onclick = () => zoom(step);
    element("zoom_out").onclick = () => zoom(1 / step);
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      zoom(wheel_step ** -event.deltaY);
    }, { passive: false });
    canvas.onpointerdown = (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.#fingers.set(event.pointerId, event);
    };
    canvas.onpointermove = (event) => {
      const before = this.#fingers.get(event.pointerId);
      if (!before) return;
      const [other] = [...this.#fingers.values()].filter(({ pointerId }) => pointerId !== event.pointerId);
      if (other) {
        const apart = (one) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY);
        zoom(apart(event) / Math.max(1, apart(before)));
      } else {
        view.pan(event.clientX - before.clientX, event.clientY - before.clientY);
        written();
      }
      this.#fingers.set(event.pointerId, event);
    };
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, ({ pointerId }) => this.#fingers.delete(pointerId));
    }
    written();
  }
}

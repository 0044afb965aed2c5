// SPDX-License-Identifier: Apache-2.0
// One WebSocket that comes back by itself.
//
// A WebSocket alone does not tell a robot that drove out of the radio's range from one that is quiet: who
// sends next to nothing gives TCP nothing to miss. Hence limits of our own: an attempt that takes longer than
// `attempt_ms_max` is given up, and so is a connection on which nothing at all came for `silence_ms_max`.

const retry_ms_min = 250;
const retry_ms_max = 5000;
const attempt_ms_max = 4000;
export const silence_ms_max = 10000;
const try_later = 1013;        // the close code of a place that another one needed …
const try_later_attempt = 3;   // … who is not driven out of it at once, but after retry_ms() of this
const turn_ms = 50;

// A moment, and the time since. The monotonic clock stands still while a phone sleeps, and the calendar may
// be set back; the larger of the two differences is never too young by either fault.
export const moment = () => ({ monotonic: performance.now(), calendar: Date.now() });
export const since_ms = (then) => Math.max(0, performance.now() - then.monotonic, Date.now() - then.calendar);

// The wait before attempt `attempt` (from 0), in milliseconds: doubles from a quarter of a second to five
// seconds.
export const retry_ms = (attempt) => Math.min(retry_ms_max, retry_ms_min * 2 ** Math.min(attempt, 16));

export class link {
  #socket;
  #timer;

  // `events`: opened(), received(message) for each object with an `op`, closed({code, reason}, was_open), and
  // turned() twenty times a second. `options`: WebSocket, subprotocols() for each attempt, decode(bytes) for
  // binary messages, may(): whether there is to be a connection now.
  constructor(url, events, options) {
    Object.assign(this, { url, events, options, attempt: 0, state: "disconnected", since: moment() });
    if (this.#may) this.#connect();
    this.#timer = setInterval(() => this.turn(), turn_ms);
  }

  // Sends one object if the connection is open and not more than `waiting_bytes_max` wait in its socket. What
  // cannot be sent now is dropped, and the answer is false: nothing is queued here.
  send(message, waiting_bytes_max = Infinity) {
    if (this.state !== "open" || this.#socket.bufferedAmount > waiting_bytes_max) return false;
    this.#socket.send(JSON.stringify(message));
    return true;
  }

  // Until the next attempt; 0 while one is under way.
  get retry_in_ms() {
    return this.state === "disconnected" ? Math.max(0, retry_ms(this.attempt) - since_ms(this.since)) : 0;
  }

  // Looks at the clocks. To be called by others only with `hurry`: the page or the network came back.
  turn(hurry) {
    this.#look(hurry);
    this.events.turned?.();
  }

  get #may() { return this.options.may?.() ?? true; }

  #look(hurry) {
    const idle_ms = since_ms(this.since);
    const idle_ms_max = this.state === "open" ? silence_ms_max : attempt_ms_max;
    const may = this.#may;
    if (this.state === "disconnected") {
      if (may && (hurry || idle_ms >= retry_ms(this.attempt))) {
        this.attempt += 1;
        this.#connect();
      }
    } else if (this.state !== "closed" && !may) {
      this.#lost({ code: 1000, reason: "not wanted any more" });
    } else if (this.state !== "closed" && idle_ms >= idle_ms_max) {
      this.#lost({ code: 1006, reason: `silent for ${idle_ms_max} ms` });
    }
  }

  // For good. The timer must not keep Node from ending.
  close() {
    clearInterval(this.#timer);
    this.#lost({ code: 1000, reason: "closed here" }, "closed");
  }

  #connect() {
    this.state = this.attempt ? "retrying" : "connecting";
    this.since = moment();
    this.#socket = null;
    let socket;
    try {
      socket = new this.options.WebSocket(this.url, this.options.subprotocols?.() ?? []);
    } catch ({ message }) {
      // A token that cannot be offered, say. Whoever made this link knows it by then.
      return queueMicrotask(() => this.#lost({ code: 1006, reason: message }));
    }
    this.#socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.state = "open";
      this.since = moment();
      this.events.opened();
    };
    socket.onmessage = ({ data }) => this.#receive(data);
    socket.onerror = () => {};  // is followed by a close, and without a handler ends a program of Node's
    socket.onclose = ({ code, reason } = {}) => {
      if (code === try_later) this.attempt = Math.max(this.attempt, try_later_attempt);
      this.#lost({ code, reason });
    };
  }

  #receive(data) {
    this.since = moment();
    let message;
    try {
      message = typeof data === "string" ? JSON.parse(data) : this.options.decode?.(new Uint8Array(data));
    } catch {
      return;
    }
    if (typeof message?.op !== "string") return;
    this.attempt = 0;  // only a peer that speaks ends the back-off, not one that merely accepts
    this.events.received(message);
  }

  // The old socket is let go without waiting for its end, which may take minutes on a dead path.
  #lost(why, state = "disconnected") {
    if (this.state === "closed") return;
    const socket = this.#socket;
    const was_open = this.state === "open";
    if (socket) socket.onopen = socket.onmessage = socket.onclose = null;
    this.state = state;
    this.since = moment();
    socket?.close();
    this.events.closed(why, was_open);
  }
}

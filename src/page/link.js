// SPDX-License-Identifier: Apache-2.0
// The page's one connection: a rosbridge v2 client that comes back by itself.
//
// A WebSocket alone does not tell a robot that drove out of the radio's range from one that is quiet: this
// page sends next to nothing, so TCP has nothing to miss. Hence two clocks of our own: an attempt that takes
// longer than `attempt_ms_max` is given up, and so is a connection on which nothing at all came for
// `silence_ms_max` (the endpoint's statistics alone come several times a second).

const retry_ms_min = 250;
const retry_ms_max = 5000;
const attempt_ms_max = 4000;
const silence_ms_max = 10000;
const late_ms = 500;       // who has not connected by then is late
const try_later = 1013;        // the close code of a place that another one needed …
const try_later_attempt = 3;   // … who is not driven out of it at once, but after retry_ms() of this

// A moment, and the time since. The monotonic clock stands still while a phone sleeps, and the calendar may
// be set back; the larger of the two differences is never too young by either fault.
export const moment = () => ({ monotonic: performance.now(), calendar: Date.now() });
export const since_ms = (then) => Math.max(0, performance.now() - then.monotonic, Date.now() - then.calendar);

// The wait before attempt `attempt` (from 0), in milliseconds: doubles from a quarter of a second to five
// seconds.
export const retry_ms = (attempt) => Math.min(retry_ms_max, retry_ms_min * 2 ** Math.min(attempt, 16));

export class link {
  // `events`: opened() after each successful connect, received(message) for each JSON object with an op,
  // refused() after an attempt that failed. `subprotocols()`: what the next attempt offers.
  constructor(url, events, subprotocols = () => []) {
    this.subprotocols = subprotocols;
    this.url = url;
    this.events = events;
    this.attempt = 0;
    this.state = "connecting";
    this.socket = null;
    this.since = moment();  // of the last frame, or of the present state
    this.#connect();
  }

  // Until the next attempt; 0 while one is under way.
  get retry_in_ms() {
    return this.state === "disconnected" ? Math.max(0, retry_ms(this.attempt) - since_ms(this.since)) : 0;
  }

  // Sends one object if the connection is open. What cannot be sent now is dropped: opened() says everything
  // anew.
  send(message) {
    if (this.state === "open") this.socket.send(JSON.stringify(message));
  }

  // To be called a few times a second, and whenever the page or the network comes back (`hurry`).
  turn(hurry = false) {
    const idle_ms = since_ms(this.since);
    if (this.state === "disconnected") {
      if (hurry || idle_ms >= retry_ms(this.attempt)) this.#retry();
    } else if (idle_ms >= (this.state === "open" ? silence_ms_max : attempt_ms_max)) {
      this.#lost();
    }
  }

  // For good.
  end() {
    this.#lost();
  }

  #retry() {
    this.attempt += 1;
    this.#connect();
  }

  #connect() {
    const socket = new WebSocket(this.url, this.subprotocols());
    this.socket = socket;
    this.state = this.attempt === 0 ? "connecting" : "retrying";
    this.since = moment();
    socket.onopen = () => {
      this.state = "open";
      this.since = moment();
      this.events.opened();
    };
    socket.onmessage = (event) => this.#receive(event.data);
    socket.onclose = (event) => {
      if (event?.code === try_later) this.attempt = Math.max(this.attempt, try_later_attempt);
      const refused = this.state !== "open";
      this.#lost();
      if (refused) this.events.refused?.();
    };
  }

  #receive(data) {
    this.since = moment();
    if (typeof data !== "string") return;
    let message;
    try {
      message = JSON.parse(data);
    } catch {
      return;
    }
    if (typeof message?.op !== "string") return;
    this.attempt = 0;  // only a peer that speaks ends the back-off, not one that merely accepts
    this.events.received(message);
  }

  // The old socket is let go without waiting for its end, which may take minutes on a dead path.
  #lost() {
    const { socket } = this;
    socket.onopen = socket.onmessage = socket.onclose = null;
    socket.close();
    this.state = "disconnected";
    this.since = moment();
  }
}

// A connection to places that are kept for one purpose: there only while the first one, which does all, is
// not. That is refused, or lost, or late.
export class kept_link {
  constructor(url, first, events, subprotocols = () => []) {
    Object.assign(this, { url, first, events, subprotocols, link: null, missed: moment() });
  }

  get state() { return this.link?.state ?? "disconnected"; }

  send(message) {
    this.link?.send(message);
  }

  // As link's.
  turn(hurry = false) {
    const { first } = this;
    if (first.state === "open") {
      this.link?.end();
      this.link = null;
      this.missed = moment();
    } else if (this.link) {
      this.link.turn(hurry);
    } else if (first.state === "disconnected" || since_ms(this.missed) >= late_ms) {
      this.link = new link(this.url, this.events, this.subprotocols);
    }
  }
}

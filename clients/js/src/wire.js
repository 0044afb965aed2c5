// SPDX-License-Identifier: Apache-2.0
// rosbridge v2 over one link: subscriptions and offers that are said again on each connection, and calls that
// always end. Nothing is kept for later: what cannot be sent now is dropped and counted, since a command that
// waits for a connection drives a robot that nobody looks at any more.

import { link, moment, silence_ms_max, since_ms } from "./link.js";

const call_ms_max = 5000;
const fresh_ms_max = 1000;
// More than this in the socket is a network that does not move: what is published then would arrive late.
const waiting_bytes_max = 65536;

// What went wrong: `code` is closed (nothing was sent), lost (sent, and the connection ended before an
// answer), timed_out, or refused; then `said` has the robot's words.
export class robot_error extends Error {
  constructor(code, message, said) {
    super(message);
    Object.assign(this, { name: "robot_error", code, said });
  }
}

export class emitter {
  #of = new Map();

  // Calls `fn` on each event of this name from now on; returns a function that ends it.
  on(name, fn) {
    if (!this.#of.has(name)) this.#of.set(name, new Set());
    this.#of.get(name).add(fn);
    return () => this.#of.get(name).delete(fn);
  }

  emit(name, ...values) {
    for (const fn of this.#of.get(name) ?? []) guarded(fn, ...values);
  }
}

// A fault of one listener is reported as uncaught, and keeps nothing from the others.
function guarded(fn, ...values) {
  try {
    fn(...values);
  } catch (error) {
    queueMicrotask(() => { throw error; });
  }
}

// What the wire holds for all subscriptions to one topic.
class shared {
  of = new Set();
  current = false;  // the last value came on this connection
  at = null;        // when it came
  refused = null;
  constructor(topic, id) { Object.assign(this, { topic, id }); }

  // One `subscribe` for all: the quickest rate, the longest queue, and what was said last of the rest.
  get message() {
    const { topic, id } = this;
    const all = [...this.of].map(({ options }) => options);
    const said = (name) => all.reduce((last, each) => each[name] ?? last, undefined);
    const most = Math.max(...all.map((each) => each.queue_length ?? (rate(each) ? 1 : Infinity)));
    return {
      op: "subscribe", id, topic, type: said("type"), throttle_rate: Math.min(...all.map(rate)),
      queue_length: most < Infinity ? most : undefined, qos: said("qos"), compression: said("encoding"),
    };
  }
}

const rate = ({ hz, throttle_ms }) => throttle_ms ?? (hz ? Math.floor(1000 / hz) : 0);

class subscription {
  #wire;
  #of;

  constructor(wire, of, fn, options) {
    this.#wire = wire;
    this.#of = of;
    Object.assign(this, { topic: of.topic, fn, options });
  }

  get last() { return this.#of.last; }
  // In the robot's words, until a value comes.
  get refused() { return this.#of.refused; }

  // Since the last value came: the age of what is shown. Without any it is infinite.
  age_ms() { return this.#of.at ? since_ms(this.#of.at) : Infinity; }

  // Whether the last value came on the present connection, and within `ms_max`.
  fresh(ms_max = fresh_ms_max) { return this.#of.current && this.age_ms() < ms_max; }

  unsubscribe() { this.#wire.unsubscribe(this, this.#of); }
}

export class wire extends emitter {
  #topics = new Map();
  #offers = new Map();
  #calls = new Map();
  #ids = 0;
  #probed = moment();
  dropped = 0;  // what was to be published and could not

  // `options` as of the link.
  constructor(url, options) {
    super();
    this.link = new link(url, {
      opened: () => this.#opened(),
      received: (message) => this.#received(message),
      closed: (why, was_open) => this.#closed(why, was_open),
      turned: () => this.#turned(),
    }, options);
  }

  get state() { return this.link.state; }
  get wanted() { return this.#topics.size > 0; }
  get retry_in_ms() { return this.link.retry_in_ms; }

  // Ends at once if there is no connection: calls are not kept for later either.
  call(service, args = {}, { timeout_ms = call_ms_max } = {}) {
    return new Promise((done, failed) => {
      const id = this.#id();
      const fail = (code, words, said) => failed(new robot_error(code, `${service}: ${words}`, said));
      if (!this.link.send({ op: "call_service", id, service, args })) {
        return fail("closed", `no connection to ${this.link.url} (${this.state})`);
      }
      const timer = setTimeout(() => {
        this.#calls.delete(id);
        fail("timed_out", `no answer within ${timeout_ms} ms`);
      }, timeout_ms);
      this.#calls.set(id, { done, fail, timer });
    });
  }

  subscribe(topic, fn, options = {}) {
    const { encoding = "none" } = options;
    if (encoding !== "none" && !this.link.options.decode) {
      throw new TypeError(`${topic}: encoding "${encoding}" needs connect(url, { decode })`);
    }
    let of = this.#topics.get(topic);
    if (!of) this.#topics.set(topic, of = new shared(topic, this.#id()));
    const made = new subscription(this, of, fn, options);
    of.of.add(made);
    this.#say(of);
    // The robot gives a latched value to the first subscription alone.
    if (options.qos?.durability === "transient_local" && of.current) {
      queueMicrotask(() => of.of.has(made) && guarded(fn, of.last, made));
    }
    return made;
  }

  unsubscribe(one, of) {
    if (!of.of.delete(one)) return;
    if (of.of.size) return this.#say(of);
    this.#topics.delete(of.topic);
    this.link.send({ op: "unsubscribe", id: of.id, topic: of.topic });
  }

  advertise(topic, type, { latch, qos } = {}) {
    const id = this.#id();
    const offer = { op: "advertise", id, topic, type, latch, qos };
    this.#offers.set(id, offer);
    this.link.send(offer);
    return {
      topic,
      publish: (msg) => this.publish(topic, msg, { latch }),
      unadvertise: () => this.#offers.delete(id) && this.link.send({ op: "unadvertise", id, topic }),
    };
  }

  // False: it was dropped. `more` are further members, such as a command's tick.
  publish(topic, msg, more, bytes_max = waiting_bytes_max) {
    const sent = this.link.send({ op: "publish", topic, msg, ...more }, bytes_max);
    if (!sent) this.dropped += 1;
    return sent;
  }

  close() { this.link.close(); }

  #id() { return `js-${(this.#ids += 1)}`; }

  // Says a subscription, unless the robot knows it as it is.
  #say(of) {
    const { message } = of;
    const text = JSON.stringify(message);
    if (text !== of.said && this.link.send(message)) of.said = text;
  }

  #opened() {
    for (const of of this.#topics.values()) this.#say(of);
    for (const offer of this.#offers.values()) this.link.send(offer);
    this.emit("open");
  }

  #received({ op, id, topic, msg, result, values, level }) {
    if (op === "publish") {
      const of = this.#topics.get(topic);
      if (!of) return;
      Object.assign(of, { last: msg, at: moment(), current: true, refused: null });
      for (const one of of.of) guarded(one.fn, msg, one);
    } else if (op === "service_response") {
      const call = this.#calls.get(id);
      if (!call) return;
      this.#calls.delete(id);
      clearTimeout(call.timer);
      if (result !== false) return call.done(values ?? {});
      call.fail("refused", typeof values === "string" ? values : JSON.stringify(values), values);
    } else if (op === "status") {
      for (const of of this.#topics.values()) if (of.id === id && level === "error") of.refused = msg;
      this.emit("status", { level, msg, id });
    }
  }

  // What was shown is old now, until each topic's next value comes.
  #closed(why, was_open) {
    for (const of of this.#topics.values()) Object.assign(of, { said: null, current: false });
    for (const { fail, timer } of this.#calls.values()) {
      clearTimeout(timer);
      fail("lost", `the connection ended (${why.code ?? 1006} ${why.reason ?? ""}) before an answer`);
    }
    this.#calls.clear();
    this.emit(was_open || this.state === "closed" ? "closed" : "refused", why);
  }

  // A robot that has nothing to say is asked for the time, so that its silence is not taken for its end.
  #turned() {
    const limit_ms = silence_ms_max / 3;
    if (this.state === "open" && Math.min(since_ms(this.link.since), since_ms(this.#probed)) > limit_ms) {
      this.#probed = moment();
      this.link.send({ op: "call_service", id: "js-probe", service: "/rosapi/get_time" });
    }
    this.emit("turned");
  }
}

// SPDX-License-Identifier: Apache-2.0
// The types of the client. Those of a robot's messages are printed by `rowe types URL > robot.ts`, whose
// `topics` and `services` are what connect() is generic over:
//
//     import { connect } from "rowe";
//     import type { services, topics } from "./robot.js";
//     const robot = connect<topics, services>("ws://127.0.0.1:8080");
//
// Without them every topic and service has the type `any`.

/** Names to types, where nothing is known of a robot. */
export type any_topics = Record<string, any>;
export type any_services = Record<string, { request: any; response: any }>;

type request_of<Service> = Service extends { request: infer Request } ? Request : any;
type response_of<Service> = Service extends { response: infer Response } ? Response : any;
/** Arguments may be left out where none is needed. */
type arguments_of<Request> = {} extends Request
  ? [args?: Request, options?: call_options]
  : [args: Request, options?: call_options];

/**
 * Begins to connect, and goes on until close(). Without a URL: to where this page came from. `http` in a URL
 * is `ws`. Throws a `robot_error` of code `no_websocket` where there is no WebSocket: Node 18 to 21 have
 * none.
 */
export function connect<Topics extends object = any_topics, Services extends object = any_services>(
  url?: string | URL, options?: connect_options): robot<Topics, Services>;

export interface connect_options {
  /** For Node 18 to 21: that of the package `ws`. */
  WebSocket?: new (url: string, protocols?: string[]) => any;
  /** Who this client is, where the robot wants to know; a function is asked at each attempt. */
  token?: string | (() => string | undefined);
  /**
   * What others are shown as the name of a guard or a driver: of a guard 31 bytes at most, of a driver 64;
   * longer ones are refused or cut. Made up if left out.
   */
  name?: string;
  /** Reads CBOR, for subscriptions with an encoding: `decode` of the package `cbor-x`, for example. */
  decode?: (bytes: Uint8Array) => unknown;
  /**
   * Whether one of the places that a robot reserves for the stop is taken whenever the first connection is
   * down, so that the stop is seen and quick: yes in a browser. If not, only while a press waits for the
   * robot.
   */
  reserved?: boolean;
}

/**
 * What failed, by its code: `closed` (nothing was sent), `lost` (it was sent, and the connection ended before
 * an answer: it is not known whether the robot has done it), `timed_out` (likewise), `refused` (by the
 * robot), `no_websocket`.
 */
export class robot_error extends Error {
  readonly name: "robot_error";
  readonly code: "closed" | "lost" | "timed_out" | "refused" | "no_websocket";
  /** Of `refused`: what the robot said, as a text or as the word of `refused` in its answer. */
  readonly said?: any;
  /** Of `refused` by the stop or by control: the whole answer. */
  readonly answer?: any;
}

/** Calls `fn` on each event from now on; returns a function that ends it. */
interface emitter<Events> {
  on<Name extends keyof Events>(name: Name, fn: Events[Name]): () => void;
}

export interface robot_events {
  /** The connection stands, and all subscriptions and offers have been said again. */
  open: () => void;
  /** A connection that stood ended, or close() was called. */
  closed: (why: { code?: number; reason?: string }) => void;
  /** An attempt to connect failed. The next one comes by itself. */
  refused: (why: { code?: number; reason?: string }) => void;
  /** What the robot reports, such as a refused subscription or publication. */
  status: (what: { level: "error" | "warning" | "info"; msg: string; id?: string }) => void;
  /** Twenty times a second: a time to show ages anew. */
  turned: () => void;
}

export interface robot<Topics extends object = any_topics, Services extends object = any_services>
  extends emitter<robot_events> {
  readonly name: string;
  readonly state: "connecting" | "open" | "disconnected" | "retrying" | "closed";
  /** Until the next attempt to connect, in milliseconds; 0 while one is under way, or none is needed. */
  readonly retry_in_ms: number;
  /**
   * How many messages were to be published and were not, since there was no connection or it did not move.
   */
  readonly dropped: number;
  readonly stop: stop;

  /**
   * Resolves when the connection stands. Fails after `timeout_ms` (10 s), and goes on trying all the same.
   */
  opened(options?: { timeout_ms?: number }): Promise<this>;

  /**
   * From now on `fn` gets each value of the topic, on this connection and all later ones. Subscriptions to
   * one topic share one on the wire: the quickest rate holds for all, and the longest queue.
   */
  subscribe<Topic extends keyof Topics & string>(
    topic: Topic, fn: (msg: Topics[Topic], of: subscription<Topics[Topic]>) => void,
    options?: subscribe_options): subscription<Topics[Topic]>;

  /** Says that this client publishes on the topic, on this connection and all later ones. */
  advertise<Topic extends keyof Topics & string>(
    topic: Topic, type: string, options?: advertise_options): publisher<Topics[Topic]>;

  /**
   * Publishes at once or not at all. False: it was dropped and counted, since there is no connection, or more
   * than 64 KiB wait in its socket. What a robot is driven by goes through drive().
   */
  publish<Topic extends keyof Topics & string>(topic: Topic, msg: Topics[Topic]): boolean;

  /** Calls a service. Fails with a `robot_error`, at the latest after `timeout_ms` (5 s). */
  call<Service extends keyof Services & string>(
    service: Service, ...args: arguments_of<request_of<Services[Service]>>
  ): Promise<response_of<Services[Service]>>;

  /** Control of a topic whose commands have a lease. Nothing is sent until take(). */
  drive<Topic extends keyof Topics & string>(
    topic: Topic, options?: drive_options<Topics[Topic]>): drive<Topics[Topic]>;

  /**
   * All that this client drives stands still. A page does so by itself when it loses the focus; when it is
   * hidden, it also releases what it drives.
   */
  halt(): void;

  /** For good. What is driven stands still, and calls that wait fail. */
  close(): void;
}

export interface call_options {
  timeout_ms?: number;
}

export interface subscribe_options {
  /** Of the messages, such as `nav_msgs/Odometry`; a robot that has the topic needs none. */
  type?: string;
  /** Not more values a second than this; the newest of those in between is kept. Or the time between two. */
  hz?: number;
  throttle_ms?: number;
  /** How many values wait in the robot for a slow network. With a rate 1, unless it is said. */
  queue_length?: number;
  /**
   * Times as in ROS 2. With `durability` `transient_local` a listener that comes later than another one gets
   * the last value of this connection at once.
   */
  qos?: qos;
  /**
   * On a second connection, which all such subscriptions share: for images and maps. Beside them the answer
   * to a stop does not wait until they have come. It is there while the first one is, and takes another
   * place of the robot's `connections_max`.
   */
  apart?: boolean;
  /** How values come; all but `none` need connect()'s `decode`. */
  encoding?: "none" | "cbor" | "cbor-raw";
}

export interface advertise_options {
  /** The robot retains the last value for who subscribes later, until this connection ends. */
  latch?: boolean;
  qos?: qos;
}

/** A time is an object of seconds and nanoseconds, as in ROS 2. */
export interface qos {
  lifespan?: { sec: number; nanosec: number };
  deadline?: { sec: number; nanosec: number };
  durability?: "volatile" | "transient_local";
  reliability?: "reliable" | "best_effort";
  history?: "keep_last" | "keep_all";
  depth?: number;
}

export interface subscription<Message = any> {
  readonly topic: string;
  /** The last value that came, on whichever connection. */
  readonly last: Message | undefined;
  /** Why the robot refused the subscription; null when it has not, or a value has come since. */
  readonly refused: string | null;
  /**
   * How long ago the last value came; infinite without any. It grows while a phone sleeps and while there is
   * no connection. The time on the way to here is not in it.
   */
  age_ms(): number;
  /** Whether the last value came on the present connection, and less than `ms_max` (1 s) ago. */
  fresh(ms_max?: number): boolean;
  unsubscribe(): void;
}

export interface publisher<Message = any> {
  readonly topic: string;
  /** As robot.publish(). */
  publish(msg: Message): boolean;
  unadvertise(): void;
}

// ---- the stop

export interface stop_state {
  state: "running" | "stopped";
  number: number;
  cause?: "start" | "request" | "guard" | "loop" | "service" | null;
  source?: string | null;
  /** How long the state has held. */
  since_ms: number;
  tick: number;
  /** It may move without a guard. */
  unguarded: boolean;
  guards: { name: string; age_ms: number | null; fresh: boolean }[];
  loops: { name: string; age_ms: number | null; acknowledged: number }[];
}

export interface acknowledgment {
  number: number;
  /** From the press to the answer. */
  took_ms: number;
  /** A part of it: from when the robot accepted the stop to the last loop's acknowledgment. */
  own_ms: number;
}

export interface stop_events {
  /** Something that is shown may have changed: with each state of the robot, five times a second at least. */
  changed: () => void;
}

export interface stop extends emitter<stop_events> {
  /** Whether the robot has a stop; null: not known yet. */
  readonly configured: boolean | null;
  /** As the robot told it last. It holds only while it is `known`. */
  readonly state: stop_state | null;
  /** The state came on a connection that stands, less than a second ago. */
  readonly known: boolean;
  /** Null where that is not known. */
  readonly stopped: boolean | null;
  /** The last press, until the robot runs again. */
  readonly asked: { readonly answer: acknowledgment | null } | null;
  /** It was pressed and is not acknowledged yet. */
  readonly pending: boolean;
  /** For more than half a second: say so, loudly. */
  readonly overdue: boolean;
  /** Only the stop works: the robot has no other place for this client. */
  readonly limited: boolean;
  readonly guarding: boolean;
  /** Why the robot ended the guarding. */
  readonly refused: string | null;
  /** As a guard. */
  readonly name: string;

  /**
   * Stops the robot: asks at once, and each 500 ms until it is acknowledged, also on later connections and on
   * the places that are reserved for the stop. The promise fails after `timeout_ms` (5 s); the asking goes
   * on. Who does not wait for the promise need not catch anything.
   */
  press(options?: { source?: string; reason?: string; timeout_ms?: number }): Promise<acknowledgment>;
  /**
   * Ends the stop of this number, the one that was shown. Fails with code `refused`; `said` is then `number`,
   * `tick`, `role`, `guards` or `loops`.
   */
  reset(number?: number, options?: call_options): Promise<{ state: "running" | "stopped"; number: number }>;
  /**
   * This client guards the robot until let_go(), or until nobody sees its page. Ends with the first
   * heartbeat.
   */
  guard(): Promise<void>;
  /** Guards no more, which stops a robot that moves. */
  let_go(): Promise<void>;
  /** The guard of this name is gone, and not to be waited for. */
  dismiss(guard: string): Promise<unknown>;
}

// ---- driving

export interface drive_options<Message = any> {
  /** What others are shown as the driver's name, if not the robot object's. */
  name?: string;
  /** What halt() sends, if not the last command with each number 0 and each boolean false. */
  zero?: Message;
}

export interface control {
  topic: string;
  driver: string | null;
  /** Another one for each driver. */
  number: number;
  yours: boolean;
  lease_ms: number;
  hold_ms: number;
  tick: number;
  refused: null;
}

/**
 * `closed`: the connection ended. `taken_over`: by `driver`. `expired`: the robot says that nobody drives, or
 * has not answered for hold_ms. `refused`: for the reason `said`.
 */
export interface lost_control {
  reason: "closed" | "taken_over" | "expired" | "refused";
  driver: string | null;
  said: string | null;
}

export interface drive_events {
  /** `held`, `driver` or `commanding` may have changed. */
  changed: () => void;
  /** This client drives no more, and did not ask for that. It does not take control again by itself. */
  lost: (why: lost_control) => void;
}

export interface drive<Message = any> extends emitter<drive_events> {
  readonly topic: string;
  /** This client drives. */
  readonly held: boolean;
  /** Who drives, by the name that all are shown; null: nobody, or it is not known. */
  readonly driver: string | null;
  /** A command is held, and repeated. */
  readonly commanding: boolean;
  /** How long a command holds in the robot. */
  readonly lease_ms: number | null;
  /** How long control is kept after the last command or heartbeat. */
  readonly hold_ms: number | null;
  /** Commands that were not sent. */
  readonly dropped: number;

  /**
   * Takes control if nobody drives. Fails with code `refused`; `said` is then `driven`, `role`, `pause` or
   * `topic`, and `answer.driver` who drives.
   */
  take(): Promise<control>;
  /** Takes control from whoever drives. Needs the right `take_over`. */
  take_over(): Promise<control>;
  /** The robot stands still, and others may drive. */
  release(): Promise<void>;
  /**
   * Holds a command: sends it, and repeats it twenty times a second until the next one or halt(). It is
   * dropped when the robot is stopped, when it could not be repeated within the lease, and when nothing came
   * from the robot for as long; then set() it again. False: nothing was sent, since this client does not
   * drive, the robot is stopped, nobody sees this page, or the network does not move. Throws a TypeError for
   * a number that is not finite.
   */
  set(command: Message): boolean;
  /** Sends one command to stand still, at once, and keeps control. False: nothing was sent. */
  halt(): boolean;
  /** Releases, and ends this object. */
  close(): Promise<void>;
}

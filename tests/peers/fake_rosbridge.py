# SPDX-License-Identifier: Apache-2.0
"""A rosbridge_server 0.11.17 (ROS 1) as it was seen on the wire, oddities included; no ROS behind it.

    with fake_rosbridge() as bridge:
        bridge.publish("/odom", "nav_msgs/Odometry", {...})   # to whoever has subscribed
        bridge.wait(lambda: bridge.arrived("/cmd_vel"), "a command")

It serves /add_two_ints (rospy_tutorials/AddTwoInts) and fails /fail. Whoever advertises a service is called
at once with the arguments that `calls_with` has for its type; the answer stands in `answers`.

What one could stumble over, each of it on purpose: every `/` is escaped and everything beyond ASCII, too;
what is wrong is answered with silence; two objects in one text are both carried out; what is published comes
out with its defaults filled in; the `total` of a fragment is no count.
"""
import json
import struct

import ros_types
from server import answer, gone, server
from websocket import BINARY, CLOSE, CONTINUATION, PING, PONG, TEXT, accept_value, frame, read_frame

services = {"/add_two_ints": "rospy_tutorials/AddTwoInts", "/fail": "std_srvs/Trigger"}
calls_with = {"std_srvs/SetBool": {"data": True}, "rospy_tutorials/AddTwoInts": {"a": 38, "b": 4},
              "std_srvs/Trigger": {}}


def text_of(value):
    """JSON as ujson writes it: no blanks, every `/` and everything beyond ASCII escaped."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False).replace("/", "\\/")


def objects_in(text):
    """The JSON objects of a text that holds nothing else; none where it does not."""
    decoder, found, at = json.JSONDecoder(), [], 0
    try:
        while at < len(text):
            one, at = decoder.raw_decode(text, at)
            found.append(one)
            while at < len(text) and text[at].isspace():
                at += 1
    except ValueError:
        return []
    return [one for one in found if isinstance(one, dict)]


class client:
    """One connection, in the eyes of the bridge."""

    def __init__(self, stream):
        self.stream = stream
        self.subscriptions = {}  # topic -> ids of its requests
        self.fragment_size = None
        self.advertised = {}  # service -> type
        self.calls = 0

    def frame(self, opcode, payload):
        self.stream.send(frame(opcode, payload, mask=False))

    def send(self, message):
        text = text_of(message)
        if self.fragment_size is None or len(text) <= self.fragment_size:
            return self.frame(TEXT, text.encode())
        size = self.fragment_size
        total = len(text_of(text)) / size  # of the text encoded once more
        for number, start in enumerate(range(0, len(text), size)):
            self.frame(TEXT, text_of({"op": "fragment", "id": 0, "data": text[start:start + size],
                                      "num": number, "total": total}).encode())

    def receive(self):
        """The next text. Answers pings, and closes as Autobahn does; binary messages are not ours."""
        text, opened = b"", None
        while True:
            first, masked, payload = read_frame(self.stream.exactly)
            opcode = first & 0x0F
            if not masked or first & 0x70:
                self.close(1002)
            if opcode == PING:
                self.frame(PONG, payload)
            elif opcode == CLOSE:
                self.close(*struct.unpack("!H", payload[:2]))
            elif opcode in (TEXT, BINARY, CONTINUATION):
                opened = opcode if opcode != CONTINUATION else opened
                text += payload
                if first & 0x80 and opened == TEXT:
                    return text.decode()
                if first & 0x80:
                    text = b""

    def close(self, *code):
        self.frame(CLOSE, struct.pack("!H", *code) if code else b"")
        self.stream.shut()
        raise gone


class fake_rosbridge(server):
    def __init__(self, port=0):
        super().__init__(port)
        self.heard = []  # (client, message): every object that came
        self.ignored = []  # texts and messages that were answered with silence
        self.published = []  # (topic, whole message)
        self.answers = []  # what clients answered when they were called
        self.clients = []
        self.topics = {}  # topic -> type
        self.waiting = {}  # id of a call to a client -> who asked, and with which id

    @property
    def url(self):
        return f"ws://127.0.0.1:{self.port}/"

    def arrived(self, topic):
        """The messages that clients published on a topic so far, whole."""
        return [message for name, message in list(self.published) if name == topic]

    def subscribers(self, topic):
        return [one for one in list(self.clients) if topic in one.subscriptions]

    def publish(self, topic, kind, message):
        """Publishes as a node of ROS would."""
        self.topics.setdefault(topic, kind)
        self.deliver(topic, ros_types.filled(kind, message))

    def call(self, service, arguments, asker=None, asker_id=None):
        """Calls a service that a client advertised."""
        provider = next(one for one in list(self.clients) if service in one.advertised)
        provider.calls += 1
        identity = f"service_request:{service}:{provider.calls}"
        self.waiting[identity] = (asker, asker_id)
        provider.send({"op": "call_service", "id": identity, "service": service, "args": arguments})

    def serve(self, one):
        asked = self.read_request(one)
        key = asked["sec-websocket-key"]
        one.send(answer("101 Switching Protocols",
                        (("Server", "AutobahnPython/22.7.1"), ("Upgrade", "WebSocket"),
                         ("Connection", "Upgrade"), ("Sec-WebSocket-Accept", accept_value(key)))))
        connected = client(one)
        self.note(self.clients, connected)
        try:
            while True:
                self.take(connected, connected.receive())
        finally:
            with self.changed:
                self.clients.remove(connected)
                self.changed.notify_all()

    def take(self, sender, text):
        found = objects_in(text)
        if not found:
            self.note(self.ignored, text)
        for message in found:
            work = getattr(self, f"on_{message.get('op')}", None)
            try:
                if work is None:
                    raise ros_types.misfit("op")
                work(sender, message)
            except (KeyError, TypeError, AttributeError, ros_types.misfit):
                self.note(self.ignored, message)  # the real one logs it, and says nothing
            self.note(self.heard, (sender, message))

    def deliver(self, topic, whole):
        message = {"op": "publish", "topic": topic, "msg": ros_types.plain(self.topics[topic], whole)}
        for one in self.subscribers(topic):
            try:
                one.send(message)
            except gone:
                pass  # its own thread notices

    # ---- what clients ask for; an exception means silence

    def on_advertise(self, _, message):
        kind = ros_types.known(message["type"])
        if kind is None or self.topics.setdefault(message["topic"], kind) != kind:
            raise ros_types.misfit(message)

    def on_unadvertise(self, _, message):
        message["topic"].strip()

    def on_publish(self, _, message):
        topic = message["topic"]
        whole = ros_types.filled(self.topics[topic], message.get("msg", {}))
        self.note(self.published, (topic, whole))
        self.deliver(topic, whole)

    def on_subscribe(self, sender, message):
        topic, kind = message["topic"], message.get("type")
        if kind is not None and ros_types.known(kind) is None:
            raise ros_types.misfit(message)
        if kind is not None:
            self.topics.setdefault(topic, ros_types.known(kind))
        self.topics[topic].strip()
        sender.subscriptions.setdefault(topic, set()).add(message.get("id"))

    def on_unsubscribe(self, sender, message):
        wanted = sender.subscriptions[message["topic"]]
        if message.get("id") is None:
            wanted.clear()
        else:
            wanted.remove(message["id"])
        if not wanted:
            del sender.subscriptions[message["topic"]]

    def on_call_service(self, sender, message):
        service, identity = message["service"], message.get("id")
        if any(service in one.advertised for one in list(self.clients)):
            return self.call(service, message.get("args", {}), sender, identity)
        kind = services.get(service)
        if kind is None:
            return self.respond(sender, identity, service, f"Service {service} does not exist", False)
        try:
            arguments = ros_types.filled(kind + "Request", message.get("args"))
        except ros_types.misfit as wrong:
            return self.respond(sender, identity, service, f"Message type {kind}Request: {wrong}", False)
        if service == "/fail":
            return self.respond(sender, identity, service,
                                f"service [{service}] responded with an error: it always fails", False)
        total = (arguments["a"] + arguments["b"] + 2**63) % 2**64 - 2**63
        return self.respond(sender, identity, service, {"sum": total}, True)

    @staticmethod
    def respond(sender, identity, service, values, result):
        message = {"op": "service_response", "service": service, "values": values, "result": result}
        sender.send(message if identity is None else {**message, "id": identity})

    def on_advertise_service(self, sender, message):
        service, kind = message["service"], ros_types.known(message["type"] + "Request")
        sender.advertised[service] = message["type"]
        if kind is not None:
            self.call(service, calls_with.get(kind.removesuffix("Request"), {}))

    def on_unadvertise_service(self, sender, message):
        del sender.advertised[message["service"]]

    def on_service_response(self, _, message):
        asker, identity = self.waiting.pop(message["id"])
        self.note(self.answers, message)
        if asker is not None:
            self.respond(asker, identity, message["service"], message["values"], message["result"])

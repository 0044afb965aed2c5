# SPDX-License-Identifier: Apache-2.0
"""Hop (the web runtime of the RAPP project) as its source has it, server and client, in two periods.

`later` is Hop after August 2014, `may_2014` the one before: there nobody masks, who does is not understood.
Both know one kind of frame, the byte 0x81: a ping, a close frame or a fragment ends the connection at once,
and so does Hop itself when it is done.
Beyond 65 535 bytes both write nine bytes of length, lowest first, in place of eight: nobody can read that.

    with hop_server("/echo", program=str.upper) as hop:        # ws://127.0.0.1:PORT/hop/echo
    with hop_client(port, period=may_2014, cookie=7) as hop:   # a robot's guest
        hop.send('{"x":1}'); hop.receive()
"""
import base64
import json
import os
import socket
import struct

from server import answer, gone, server, stream, timeout
from websocket import accept_value, read_answer, refused

later, may_2014 = "later", "May 2014"
text_frame = 0x81


class dropped(Exception):
    """Hop met a frame it does not know, and has closed; `byte` is its first, or that of its length."""

    def __init__(self, byte):
        super().__init__(f"Hop met the byte 0x{byte:02x}")
        self.byte = byte


def frame(text, period, masked):
    """One text frame in Hop's own way of writing lengths."""
    payload = text.encode()
    size, flag = len(payload), 0x80 if masked else 0
    if size <= 125:
        head = bytes((text_frame, flag | size))
    elif size <= 65535:
        head = struct.pack("!BBH", text_frame, flag | 126, size)
    elif period == later:
        head = bytes((text_frame, flag | 127)) + size.to_bytes(9, "little")
    else:
        head = bytes((text_frame,)) + size.to_bytes(9, "little")
    if not masked:
        return head + payload
    key = os.urandom(4)
    return head + key + bytes(byte ^ key[i & 3] for i, byte in enumerate(payload))


def read_text(one, period):
    """The next message. Raises dropped or gone."""
    (first,) = one.exactly(1)
    if first != text_frame:
        raise dropped(first)
    (second,) = one.exactly(1)
    if second & 0x80 and period == may_2014:
        raise dropped(second)
    size = second & 0x7F
    if size == 126:
        (size,) = struct.unpack("!H", one.exactly(2))
    elif size == 127:
        high, size = struct.unpack("!LL", one.exactly(8))
        if high:
            raise dropped(second)
    key = one.exactly(4) if second & 0x80 else bytes(4)
    return bytes(byte ^ key[i & 3] for i, byte in enumerate(one.exactly(size))).decode()


def adds_two_numbers(text):
    """The program of the paper: answers add-two-numbers, and nothing else."""
    asked = json.loads(text)
    if asked.get("service") != "add-two-numbers":
        return None
    return json.dumps({"result": asked["a"] + asked["b"], "in_reply_to": asked["message_id"]})


class hop_server(server):
    """`new WebSocketServer({path})` with a program that gives an answer, or None, to each text."""

    def __init__(self, path="/robot", period=later, program=adds_two_numbers, port=0):
        super().__init__(port)
        self.path, self.period, self.program = "/hop" + path, period, program
        self.upgraded = []  # streams
        self.heard = []  # texts
        self.drops = []  # the bytes that ended a connection
        self.ends = []  # connections that ended in any way

    @property
    def url(self):
        return f"ws://127.0.0.1:{self.port}{self.path}"

    def send(self, text):
        """To everybody."""
        for one in list(self.upgraded):
            try:
                one.send(frame(text, self.period, masked=False))
            except gone:
                pass  # its own thread notices

    def serve(self, one):
        try:
            self.upgrade(one)
            while True:
                text = read_text(one, self.period)
                said = self.program(text)
                if said is not None:
                    one.send(frame(said, self.period, masked=False))
                self.note(self.heard, text)
        except dropped as unknown:
            self.note(self.drops, unknown.byte)
        finally:
            one.shut()
            self.note(self.ends, one)

    def upgrade(self, one):
        asked = self.read_request(one)
        if asked.path.split("?")[0] != self.path:
            one.send(answer("404 Not Found", (("Content-Length", "0"), ("Connection", "close"))))
            raise gone
        fields = (("Upgrade", "WebSocket"), ("Connection", "Upgrade"),
                  ("Sec-WebSocket-Accept", accept_value(asked["sec-websocket-key"])))
        one.send(answer("101 Switching Protocols", fields))
        self.note(self.upgraded, one)


class hop_client:
    """`new WebSocket("ws://127.0.0.1:port/path", protocol)` of a Hop program. Raises refused."""

    def __init__(self, port, path="/", period=later, cookie=1804289383, protocol=None):
        self.period, self.masks = period, period == later
        key = base64.b64encode(f"ws{cookie}".encode()).decode()
        at = f"127.0.0.1:{port}"
        fields = [("User-Agent", "Hop 3.1.0"), ("Connection", "Upgrade"), ("Upgrade", "websocket"),
                  ("Origin", f"http://{at}"), ("Sec-WebSocket-Key", key), ("Sec-WebSocket-Version", "13")]
        if period == may_2014:  # in small letters, and in another order
            fields = [(name.lower(), value.lower() if name == "Connection" else value)
                      for name, value in fields[2:3] + fields[1:2] + fields[3:] + fields[:1]]
        elif protocol:
            fields += [("Sec-WebSocket-Protocol", protocol)]
        lines = "".join(f"{name}: {value}\r\n" for name, value in [("Host", at), *fields])
        connected = socket.create_connection(("127.0.0.1", port), timeout=timeout)
        try:
            connected.sendall(f"GET {path} HTTP/1.1\r\n{lines}\r\n".encode())
            status, self.fields, body, behind = read_answer(connected)
            if status != 101 or self.fields.get("sec-websocket-accept") != accept_value(key):
                raise refused(status, self.fields, body.decode(errors="replace"))
        except BaseException:
            connected.close()
            raise
        self.stream = stream(connected)
        self.stream.buffer = behind

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stream.socket.close()

    def send(self, text):
        self.stream.send(frame(text, self.period, self.masks))

    def receive(self, wait=timeout):
        """The next text. Raises dropped when it is not one, gone at the end, TimeoutError."""
        self.stream.socket.settimeout(wait)
        try:
            return read_text(self.stream, self.period)
        except dropped:
            self.stream.shut()
            raise
        except gone as end:
            if isinstance(end.__cause__, TimeoutError):
                raise TimeoutError from end
            raise

    def close(self):
        """As Hop closes: by TCP alone."""
        self.stream.shut()

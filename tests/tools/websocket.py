# SPDX-License-Identifier: Apache-2.0
"""WebSocket clients and servers on plain sockets that can be as odd as a test wants: RFC 6455 written out, no
library, and no code in common with what it tests.

    with peer(port) as p:
        p.send({"op": "subscribe", "topic": "/odom"})
        message = p.receive()          # a dict; answers pings on the way

    with listener() as there:          # at there.url
        with there.accept() as p:      # a peer that is the server's side
            p.send({"a": 1})
"""
import base64
import hashlib
import json
import os
import re
import socket
import struct
import time

CONTINUATION, TEXT, BINARY, CLOSE, PING, PONG = 0x0, 0x1, 0x2, 0x8, 0x9, 0xA
timeout = 60.0  # seconds; the end of every wait


class refused(Exception):
    """The answer to the handshake was not 101."""

    def __init__(self, status, headers, body):
        super().__init__(f"{status}: {body!r}")
        self.status, self.headers, self.body = status, headers, body


class closed(Exception):
    """The connection ended; `code` is that of the close frame, None without one."""

    def __init__(self, code=None, reason=""):
        super().__init__(f"closed with {code} {reason}")
        self.code, self.reason = code, reason


def connect(port, host="127.0.0.1", secure=None):
    """`secure`: the ssl.SSLContext of a connection by TLS."""
    stream = socket.create_connection((host, port), timeout=timeout)
    stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return secure.wrap_socket(stream, server_hostname=host) if secure else stream


def request(method, path, fields):
    lines = "".join(f"{name}: {value}\r\n" for name, value in fields.items())
    return f"{method} {path} HTTP/1.1\r\n{lines}\r\n".encode()


def read_answer(stream):
    """Reads one HTTP answer: status, headers (names in lower case), body, and what came behind it."""
    data = b""
    while b"\r\n\r\n" not in data:
        more = stream.recv(65536)
        if not more:
            raise closed(None, f"while answering: {data!r}")
        data += more
    head, rest = data.split(b"\r\n\r\n", 1)
    first, *lines = head.decode("latin-1").split("\r\n")
    headers = {name.strip().lower(): value.strip() for name, value in (line.split(":", 1) for line in lines)}
    length = int(headers.get("content-length", 0))
    while len(rest) < length:
        more = stream.recv(65536)
        if not more:
            break
        rest += more
    return int(first.split()[1]), headers, rest[:length], rest[length:]


def get(port, path="/", headers=None, host="127.0.0.1", method="GET", secure=None):
    """One HTTP request on a connection of its own: status, headers, body."""
    fields = {"Host": f"{host}:{port}", "Connection": "close", **(headers or {})}
    with connect(port, host, secure) as stream:
        stream.sendall(request(method, path, fields))
        return read_answer(stream)[:3]


def frame(opcode, payload=b"", fin=True, mask=True, reserved=0):
    """The bytes of one frame."""
    size = len(payload)
    first = (0x80 if fin else 0) | reserved << 4 | opcode
    masked = 0x80 if mask else 0
    if size < 126:
        head = struct.pack("!BB", first, masked | size)
    elif size < 65536:
        head = struct.pack("!BBH", first, masked | 126, size)
    else:
        head = struct.pack("!BBQ", first, masked | 127, size)
    if not mask:
        return head + payload
    key = os.urandom(4)
    return head + key + bytes(byte ^ key[i % 4] for i, byte in enumerate(payload))


def read_frame(exactly):
    """The next frame: its first byte, whether it is masked, and its payload. `exactly(n)` gives n bytes."""
    first, second = exactly(2)
    length = second & 0x7F
    if length == 126:
        (length,) = struct.unpack("!H", exactly(2))
    elif length == 127:
        (length,) = struct.unpack("!Q", exactly(8))
    key = exactly(4) if second & 0x80 else b""
    payload = exactly(length)
    if key:
        whole = (key * (length // 4 + 1))[:length]
        clear = int.from_bytes(payload, "big") ^ int.from_bytes(whole, "big")
        payload = clear.to_bytes(length, "big")
    return first, bool(key), payload


def accept_value(key):
    digest = hashlib.sha1((key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11").encode()).digest()
    return base64.b64encode(digest).decode()


class peer:
    masks = True  # as a client does

    def __init__(self, port, host="127.0.0.1", path="/", headers=None, secure=None):
        key = base64.b64encode(os.urandom(16)).decode()
        fields = {"Host": f"{host}:{port}", "Upgrade": "websocket", "Connection": "Upgrade",
                  "Sec-WebSocket-Key": key, "Sec-WebSocket-Version": "13", **(headers or {})}
        self.stream = connect(port, host, secure)
        self.buffer = b""
        try:
            self.stream.sendall(request("GET", path, fields))
            status, answer, body, self.buffer = read_answer(self.stream)
            if status != 101:
                raise refused(status, answer, body.decode(errors="replace"))
            assert answer["sec-websocket-accept"] == accept_value(key), answer
        except BaseException:
            self.stream.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stream.close()

    def send_raw(self, data):
        self.stream.sendall(data)

    def send_frame(self, opcode, payload=b"", **how):
        self.send_raw(frame(opcode, payload, **{"mask": self.masks, **how}))

    def send_text(self, text, **how):
        self.send_frame(TEXT, text.encode(), **how)

    def send(self, message):
        self.send_text(json.dumps(message))

    def exactly(self, count, end):
        while len(self.buffer) < count:
            self.stream.settimeout(max(0.001, end - time.monotonic()))
            more = self.stream.recv(65536)
            if not more:
                raise closed()
            self.buffer += more
        data, self.buffer = self.buffer[:count], self.buffer[count:]
        return data

    def receive_frame(self, wait=timeout):
        """(fin, opcode, payload); TimeoutError after `wait` seconds. Clients mask, servers must not."""
        end = time.monotonic() + wait
        try:
            first, masked, payload = read_frame(lambda count: self.exactly(count, end))
            assert masked != self.masks, "the other side masked a frame, or ought to have"
            return bool(first & 0x80), first & 0x0F, payload
        except ConnectionResetError as error:
            raise closed(None, "reset") from error

    def receive_text(self, wait=timeout):
        """The next message. Answers pings; raises closed at the end."""
        end = time.monotonic() + wait
        text = b""
        while True:
            fin, opcode, payload = self.receive_frame(end - time.monotonic())
            if opcode == PING:
                self.send_frame(PONG, payload)
            elif opcode == CLOSE:
                code = struct.unpack("!H", payload[:2])[0] if len(payload) >= 2 else None
                raise closed(code, payload[2:].decode())
            elif opcode in (TEXT, CONTINUATION):
                text += payload
                if fin:
                    return text.decode()

    def receive(self, wait=timeout):
        return json.loads(self.receive_text(wait))

    def receive_until(self, wanted, wait=timeout):
        """The next message for which wanted(message) is true; others are passed over."""
        end = time.monotonic() + wait
        while True:
            message = self.receive(end - time.monotonic())
            if wanted(message):
                return message

    def subscribe(self, topic, **more):
        """Returns when the hub has done it."""
        self.send({"op": "subscribe", "topic": topic, **more})
        settle(self)

    def call(self, service, identity="now", **args):
        """The answer to a call."""
        self.send({"op": "call_service", "service": service, "id": identity, "args": args})
        return self.receive_until(lambda m: m.get("op") == "service_response")

    def called(self):
        """The next call of a service that it is to answer."""
        return self.receive_until(lambda m: m.get("op") == "call_service")

    def answer(self, call, values, result=True):
        self.send({"op": "service_response", "service": call["service"], "id": call["id"], "values": values,
                   "result": result})

    def wait_for_close(self, wait=timeout):
        """Waits for the end; returns the code of the close frame, None without one."""
        end = time.monotonic() + wait
        while True:
            try:
                _, opcode, payload = self.receive_frame(end - time.monotonic())
            except closed as ended:
                return ended.code
            if opcode == PING:
                self.send_frame(PONG, payload)
            if opcode == CLOSE:
                return struct.unpack("!H", payload[:2])[0] if len(payload) >= 2 else None


def settle(p):
    """Returns when the hub has carried out all that `p` asked for so far: it does so in order."""
    p.send({"op": "no such thing", "id": "settle"})
    return p.receive_until(lambda m: m["op"] == "status")


def ask_in_time(p, service, **what):
    """The answer's values of what wants the stop's newest tick: again where that came back too late."""
    while True:
        tick = p.call("/rowe/stop/state")["values"]["tick"]
        values = p.call(service, **what, tick=tick)["values"]
        if values["refused"] != "tick":
            return values


class accepted(peer):
    """The server's side of a connection, from the handshake on."""

    masks = False

    def __init__(self, stream):
        self.stream, self.buffer = stream, b""
        head = b""
        while not head.endswith(b"\r\n\r\n"):
            head += self.exactly(1, time.monotonic() + timeout)
        self.path = head.split()[1].decode()
        (key,) = re.findall(r"(?i)\r\nsec-websocket-key: *(\S+)", head.decode("latin-1"))
        self.send_raw(f"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                      f"Sec-WebSocket-Accept: {accept_value(key)}\r\n\r\n".encode())


class listener:
    """A port that connections are accepted on, one after another. `window`: their receive buffers' bytes."""

    def __init__(self, window=None):
        self.socket = socket.socket()
        if window is not None:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, window)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.listen()
        self.port = self.socket.getsockname()[1]
        self.url = f"ws://127.0.0.1:{self.port}/"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def accept(self):
        self.socket.settimeout(timeout)
        return accepted(self.socket.accept()[0])

# SPDX-License-Identifier: Apache-2.0
"""Frames of RFC 6455, built as wrongly as one likes and read as strictly as one can."""
import contextlib
import os
import ssl
import struct

CONTINUATION, TEXT, BINARY, CLOSE, PING, PONG = 0, 1, 2, 8, 9, 10


class frame:
    """One frame. What is left out is right; `length` and `length_bytes` may lie."""

    def __init__(self, opcode, payload=b"", fin=True, reserved=0, wrong_mask=False, key=None, length=None,
                 length_bytes=None):
        self.opcode, self.payload, self.fin, self.reserved = opcode, payload, fin, reserved
        self.wrong_mask, self.key = wrong_mask, key
        self.length = len(payload) if length is None else length
        self.length_bytes = length_bytes

    def to_bytes(self, role_masks):
        masked = role_masks != self.wrong_mask
        first = (0x80 if self.fin else 0) | self.reserved << 4 | self.opcode
        size = self.length_bytes
        if size is None:
            size = 0 if self.length <= 125 else 2 if self.length <= 0xffff else 8
        bit = 0x80 if masked else 0
        if size == 0:
            head = bytes([first, bit | self.length])
        elif size == 2:
            head = bytes([first, bit | 126]) + struct.pack("!H", self.length)
        else:
            head = bytes([first, bit | 127]) + struct.pack("!Q", self.length)
        if not masked:
            return head + self.payload
        key = os.urandom(4) if self.key is None else self.key
        return head + key + xor(self.payload, key)


def xor(data, key):
    """Masking by one large number: quick without any library."""
    pattern = (key * (len(data) // 4 + 1))[:len(data)]
    number = int.from_bytes(data, "big") ^ int.from_bytes(pattern, "big")
    return number.to_bytes(len(data), "big")


def close_body(code, reason=b""):
    return struct.pack("!H", code) + reason


def cut(opcode, payload, sizes):
    """A message in fragments of these sizes, and one more with the rest."""
    frames, at = [], 0
    for size in sizes:
        frames.append(frame(opcode if not frames else CONTINUATION, payload[at:at + size], fin=False))
        at += size
    frames.append(frame(opcode if not frames else CONTINUATION, payload[at:]))
    return frames


def to_bytes(script, role_masks):
    """Frames and raw bytes to bytes."""
    return b"".join(one if isinstance(one, bytes) else one.to_bytes(role_masks) for one in script)


class wrong(AssertionError):
    """The peer did what RFC 6455 forbids."""


class ended(Exception):
    """The stream is over; `data` is what of an unfinished frame was there."""


class stream:
    """A socket behind its handshake. Each frame that comes is held to the RFC."""

    def __init__(self, socket, peer_masks, begin=b""):
        self.socket, self.peer_masks, self.buffer = socket, peer_masks, bytearray(begin)
        self.keys = []  # of the frames that came
        self.open = None  # opcode of the message whose fragments come
        self.parts = b""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def send(self, *script):
        self.socket.sendall(to_bytes(script, not self.peer_masks))

    def send_what_it_takes(self, way, *script):
        """By send() or send_bytewise(). It may be faster than we and close; what it said is still there."""
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):
            getattr(self, way)(*script)

    def send_bytewise(self, *script):
        data = to_bytes(script, not self.peer_masks)
        for at in range(len(data)):
            self.socket.sendall(data[at:at + 1])

    def take(self, count):
        while len(self.buffer) < count:
            piece = self.socket.recv(1 << 20)
            if not piece:
                raise ended(bytes(self.buffer))
            self.buffer += piece
        data = bytes(self.buffer[:count])
        del self.buffer[:count]
        return data

    def frame(self):
        """The next frame: (fin, opcode, payload)."""
        first, second = self.take(2)
        if first & 0x70:
            raise wrong("5.2: a reserved bit is set")
        fin, opcode = bool(first & 0x80), first & 0xf
        if opcode not in (CONTINUATION, TEXT, BINARY, CLOSE, PING, PONG):
            raise wrong(f"5.2: opcode {opcode}")
        if bool(second & 0x80) != self.peer_masks:
            raise wrong("5.1: masked by a server, or not by a client")
        length = second & 0x7f
        if length == 126:
            length, = struct.unpack("!H", self.take(2))
            if length <= 125:
                raise wrong("5.2: the length is not in its shortest form")
        elif length == 127:
            length, = struct.unpack("!Q", self.take(8))
            if length <= 0xffff or length >> 63:
                raise wrong("5.2: the length is not in its shortest form")
        if opcode >= CLOSE and (length > 125 or not fin):
            raise wrong("5.5: a control frame is long or fragmented")
        if not self.peer_masks:
            return self.check(fin, opcode, self.take(length))
        key = self.take(4)
        self.keys.append(key)
        return self.check(fin, opcode, xor(self.take(length), key))

    def check(self, fin, opcode, payload):
        if opcode == CLOSE:
            if len(payload) == 1:
                raise wrong("5.5.1: half a close code")
            if payload:
                code, = struct.unpack("!H", payload[:2])
                if code < 1000 or code in (1004, 1005, 1006, 1015) or code >= 5000:
                    raise wrong(f"7.4: close code {code}")
                payload[2:].decode()  # 5.5.1: UTF-8
        if opcode >= CLOSE:
            return fin, opcode, payload
        if (opcode == CONTINUATION) != (self.open is not None):
            raise wrong("5.4: fragments out of order")
        if opcode != CONTINUATION:
            self.open = opcode
        self.parts = payload if opcode != CONTINUATION else self.parts + payload
        if fin and self.open == TEXT:
            self.parts.decode()  # 8.1
        if fin:
            self.open = None
        return fin, opcode, payload

    def event(self):
        """The next whole message or control frame: (opcode, payload)."""
        while True:
            begun = self.open
            fin, opcode, payload = self.frame()
            if opcode >= CLOSE:
                return opcode, payload
            if fin:
                return (opcode if begun is None else begun), self.parts

    def message(self):
        """The next event that is no ping; those are answered."""
        while True:
            opcode, payload = self.event()
            if opcode != PING:
                return opcode, payload
            self.send(frame(PONG, payload))

    def until_close(self):
        """What comes up to the Close frame, its code (None: an empty one), and its reason; then the end."""
        before = []
        while True:
            try:
                opcode, payload = self.event()
            except (ended, ConnectionError) as failure:
                raise wrong(f"7.1: the stream ended without a Close frame, after {before}") from failure
            if opcode == CLOSE:
                break
            before.append((opcode, payload))
        code = struct.unpack("!H", payload[:2])[0] if payload else None
        return before, code, payload[2:].decode()

    def until_end(self):
        """Waits for the end of the stream; nothing may come before it."""
        try:
            rest = bytes(self.buffer) or self.socket.recv(4096)
        except (ConnectionResetError, ssl.SSLError):
            return
        if rest:
            raise wrong(f"5.5.1: {rest[:40]} came after the Close frame")

# SPDX-License-Identifier: Apache-2.0
"""What is sent and what must come back, by section of RFC 6455. The cases are the same in both roles: masks
are put on when a case is sent, or left off."""
import collections
import itertools
import json

from frames import (BINARY, CLOSE, CONTINUATION, PING, PONG, TEXT, close_body, cut, frame)

# What the RFC says and no case asks for, and why.
waived = (
    ("4.1", "proxies, one attempt to a host at a time, wss",
     "rowe's client knows neither proxies nor TLS, and one endpoint makes one attempt at a time"),
    ("4.2.2", "401 and redirects by the server", "rowe has no accounts and nothing to redirect to"),
    ("5.8, 9", "extensions that are negotiated", "rowe offers and accepts none; that it does so is tested"),
    ("6.1", "outgoing fragments", "rowe sends whole messages only; each frame it sends is held to section 5"),
    ("7.1.1", "a client should let the server close TCP first",
     "rowe's client ends its side once its Close frame is out, and then waits for the server's end"),
    ("7.2.3", "back-off after an abnormal end",
     "takes long by the clock: the core's tests have it, with a clock of their own"),
    ("8.1", "failing at the first wrong byte",
     "the RFC demands an end, not when; the parser's tests have it"),
    ("4.1, RFC 9112 2.2", "empty lines before a request, and a request for an absolute URI",
     "refused with 400: only proxies' clients write them, and what has one meaning is safer"),
    ("RFC 9112 2.2", "lines that end in a bare line feed",
     "refused in both roles: a recipient may take them, and two that do it differently can be played off"),
)

# script: frames and raw bytes. replies: [(opcode, payload)], what an echo sends back. code: what the Close
# frame then says, or several that may; nothing: the connection goes on.
class case(collections.namedtuple("case", "section name script replies code", defaults=((), None))):
    def codes(self):
        return self.code if isinstance(self.code, tuple) else (self.code,)


hello = b"Hello, world"


def names(opcode):
    return {CONTINUATION: "continuation", TEXT: "text", BINARY: "binary", CLOSE: "close", PING: "ping",
            PONG: "pong"}.get(opcode, f"opcode {opcode:x}")


def masks():
    for opcode, payload in itertools.product((TEXT, BINARY, PING, PONG, CLOSE), (b"", hello)):
        if opcode == CLOSE and payload:
            payload = close_body(1000)
        yield case("5.1", f"{names(opcode)} of {len(payload)} bytes, masked wrongly",
                   [frame(opcode, payload, wrong_mask=True)], code=1002)
    yield case("5.1", "a continuation masked wrongly",
               [frame(TEXT, hello, fin=False), frame(CONTINUATION, hello, wrong_mask=True)], code=1002)
    yield case("5.1", "a message before a frame masked wrongly",
               [frame(TEXT, hello), frame(TEXT, hello, wrong_mask=True)], [(TEXT, hello)], 1002)


def reserved_bits():
    for bits, opcode in itertools.product(range(1, 8), (TEXT, BINARY, PING, PONG, CLOSE)):
        payload = close_body(1000) if opcode == CLOSE else hello
        yield case("5.2", f"reserved bits {bits:03b} on {names(opcode)}",
                   [frame(opcode, payload, reserved=bits)], code=1002)
    for bits in (1, 2, 4):
        yield case("5.2", f"reserved bits {bits:03b} on a continuation",
                   [frame(TEXT, hello, fin=False), frame(CONTINUATION, hello, reserved=bits)], code=1002)
    yield case("5.2", "a message, then a reserved bit, then a ping",
               [frame(TEXT, hello), frame(TEXT, hello, reserved=4), frame(PING)], [(TEXT, hello)], 1002)


def opcodes():
    for opcode, payload in itertools.product((*range(3, 8), *range(0xb, 0x10)), (b"", hello)):
        yield case("5.2", f"reserved opcode {opcode:x} with {len(payload)} bytes", [frame(opcode, payload)],
                   code=1002)
    for opcode in (3, 7, 0xb, 0xf):
        yield case("5.2", f"reserved opcode {opcode:x} behind a message and before a ping",
                   [frame(TEXT, hello), frame(opcode, hello), frame(PING)], [(TEXT, hello)], 1002)
        yield case("5.2", f"reserved opcode {opcode:x} without FIN", [frame(opcode, hello, fin=False)],
                   code=1002)
        yield case("5.2", f"reserved opcode {opcode:x} between fragments",
                   [frame(TEXT, hello, fin=False), frame(opcode), frame(CONTINUATION, hello)], code=1002)


def lengths():
    for opcode, length, size in ((TEXT, 0, 2), (TEXT, 1, 2), (TEXT, 125, 2), (TEXT, 0, 8), (TEXT, 125, 8),
                                 (TEXT, 126, 8), (TEXT, 65535, 8), (BINARY, 0, 2), (BINARY, 65535, 8)):
        yield case("5.2", f"{names(opcode)} of {length} bytes, its length in {size} bytes",
                   [frame(opcode, b"x" * length, length_bytes=size)], code=1002)
    yield case("5.2", "a continuation of 5 bytes, its length in 2",
               [frame(TEXT, b"x", fin=False), frame(CONTINUATION, b"xxxxx", length_bytes=2)], code=1002)
    for length in (2**63, 2**64 - 1):
        yield case("5.2", f"the top bit of the length {length:x}",
                   [frame(TEXT, length=length, length_bytes=8)], code=1002)
    for length in (2**24 + 1, 2**31, 2**32, 2**32 + 5, 2**62, 2**63 - 1):
        for opcode in (TEXT, BINARY):
            yield case("10.4", f"{names(opcode)} that claims {length} bytes",
                       [frame(opcode, length=length, length_bytes=8)], code=1009)
    yield case("10.4", "fragments whose lengths add up beyond 64 bits",
               [frame(TEXT, hello, fin=False), frame(CONTINUATION, length=2**63 - 1, length_bytes=8)],
               code=1009)


def fragments_out_of_order():
    for fin in (True, False):
        yield case("5.4", f"a continuation of nothing, FIN {int(fin)}", [frame(CONTINUATION, hello, fin=fin)],
                   code=1002)
        yield case("5.4", f"an empty continuation of nothing, FIN {int(fin)}", [frame(CONTINUATION, fin=fin)],
                   code=1002)
    yield case("5.4", "a continuation behind a whole message",
               [frame(TEXT, hello), frame(CONTINUATION, hello)], [(TEXT, hello)], 1002)
    yield case("5.4", "a continuation behind a fragmented message",
               [*cut(TEXT, hello, [5]), frame(CONTINUATION, hello)], [(TEXT, hello)], 1002)
    yield case("5.4", "a continuation behind a ping", [frame(PING, hello), frame(CONTINUATION, hello)],
               [(PONG, hello)], 1002)
    for first, second, fin in itertools.product((TEXT, BINARY), (TEXT, BINARY), (True, False)):
        yield case("5.4", f"{names(second)} with FIN {int(fin)} inside a fragmented {names(first)}",
                   [frame(first, hello, fin=False), frame(second, hello, fin=fin)], code=1002)
    yield case("5.4", "two messages begun at once",
               [frame(TEXT, b"", fin=False), frame(TEXT, b"", fin=False), frame(CONTINUATION, b"")],
               code=1002)


def control_frames():
    for opcode in (PING, PONG, CLOSE):
        body = close_body(1000)
        for length in (126, 127, 65535, 65536):
            payload = body + b"x" * (length - 2)
            yield case("5.5", f"a {names(opcode)} of {length} bytes", [frame(opcode, payload)], code=1002)
        yield case("5.5", f"a {names(opcode)} of 5 bytes, its length in 2",
                   [frame(opcode, body + b"abc", length_bytes=2)], code=1002)
        yield case("5.5", f"a {names(opcode)} without FIN", [frame(opcode, body, fin=False)], code=1002)
        yield case("5.5", f"a {names(opcode)} without FIN between fragments",
                   [frame(TEXT, hello, fin=False), frame(opcode, body, fin=False)], code=1002)
        yield case("5.5", f"a {names(opcode)} in two fragments",
                   [frame(opcode, body, fin=False), frame(CONTINUATION, hello)], code=1002)


valid_codes = (1000, 1001, 1002, 1003, 1007, 1008, 1009, 1010, 1011, 1012, 1013, 1014, 3000, 3999, 4000,
               4999)
invalid_codes = (0, 1, 999, 1004, 1005, 1006, 1015, 1016, 1100, 1999, 2000, 2999, 5000, 65535)


def closes():
    yield case("5.5.1", "an empty close", [frame(CLOSE)], code=(None, 1000))
    yield case("5.5.1", "a close with half a code", [frame(CLOSE, b"\x03")], code=1002)
    for code in valid_codes:
        yield case("7.4", f"close {code}", [frame(CLOSE, close_body(code))], code=code)
        yield case("7.4", f"close {code} with a reason", [frame(CLOSE, close_body(code, b"so it is"))],
                   code=code)
    for code in invalid_codes:
        yield case("7.4", f"close {code}, which is none", [frame(CLOSE, close_body(code))], code=1002)
        yield case("7.4", f"close {code}, which is none, with a reason",
                   [frame(CLOSE, close_body(code, b"so it is"))], code=1002)
    for reason in (b"x" * 123, "\u00fc".encode() * 61, "\U0001f916".encode() * 30):
        yield case("5.5.1", f"a close with a reason of {len(reason)} bytes",
                   [frame(CLOSE, close_body(1000, reason))], code=1000)
    for reason in (b"\xff", b"\xce", b"ok \xed\xa0\x80", b"x" * 122 + b"\xc3", b"\xc0\xaf",
                   b"\xf4\x90\x80\x80"):
        yield case("8.1", f"a close with the reason {reason[-4:]!r}, which is not UTF-8",
                   [frame(CLOSE, close_body(1000, reason))], code=1007)
    yield case("5.5.1", "a message, then close", [frame(TEXT, hello), frame(CLOSE, close_body(1000))],
               [(TEXT, hello)], 1000)
    end = frame(CLOSE, close_body(1000))
    for name, behind in (("text", [frame(TEXT, hello)]), ("ping", [frame(PING)]), ("close", [end]),
                         ("a reserved opcode", [frame(3)]), ("what is no frame", [b"\xff" * 100]),
                         ("64 KiB", [frame(BINARY, bytes(65536))])):
        yield case("5.5.1", f"{name} behind close", [end, *behind], code=1000)
    yield case("5.5.1", "close inside a fragmented message",
               [frame(TEXT, hello, fin=False), end, frame(CONTINUATION, hello)], code=1000)
    yield case("5.5.1", "close behind half a character",
               [frame(TEXT, b"\xce", fin=False), end], code=1000)
    yield case("5.5.1", "a ping, then close", [frame(PING, hello), end], [(PONG, hello)], 1000)


valid_texts = [text.encode() for text in (
    "\u03ba\u1f79\u03c3\u03bc\u03b5", "\x00", "\x7f", "\x80", "\u07ff", "\u0800", "\ud7ff", "\ue000",
    "\ufeff",
    "\ufffd", "\ufffe", "\uffff", "\U00010000", "\U0001f916", "\U0001fffe", "\U0010fffd", "\U0010ffff",
    "a\u00e9\u20ac\U00010348z", "\u0300\u0301 on nothing", "\r\n\t\b", "\u202eright to left")]

invalid_texts = (
    # continuation bytes that continue nothing
    b"\x80", b"\xbf", b"\x80\xbf", b"a\x80b", b"\x80" * 8, b"\xc3\xa9\x80",
    # characters that begin and do not go on
    b"\xc3", b"\xc3 ", b"\xdf(", b"\xe2\x82", b"\xe2", b"\xe2 ", b"\xe2\x82 ", b"\xe2(\xa1", b"\xf0",
    b"\xf0\x9f", b"\xf0\x9f\xa4", b"\xf0\x9f\xa4 ", b"\xf0(\x8c\xbc", b"\xf0\x90(\xbc", b"\xc3\xc3\xa9",
    b"\xe2\xe2\x82\xac",
    b"ok\xce", "\u03ba\u1f79".encode() + b"\xe1\xbd",
    # longer than need be
    b"\xc0\x80", b"\xc0\xaf", b"\xc1\xbf", b"\xe0\x80\x80", b"\xe0\x80\xaf", b"\xe0\x9f\xbf",
    b"\xf0\x80\x80\x80", b"\xf0\x80\x80\xaf", b"\xf0\x8f\xbf\xbf", b"\xf8\x80\x80\x80\xaf",
    b"\xf8\x88\x80\x80\x80",
    b"\xfc\x80\x80\x80\x80\xaf", b"\xfc\x84\x80\x80\x80\x80",
    # halves of surrogate pairs, and pairs of them
    b"\xed\xa0\x80", b"\xed\xad\xbf", b"\xed\xae\x80", b"\xed\xaf\xbf", b"\xed\xb0\x80", b"\xed\xbe\x80",
    b"\xed\xbf\xbf", b"\xed\xa0\x80\xed\xb0\x80", b"\xed\xaf\xbf\xed\xbf\xbf",
    # beyond U+10FFFF, and bytes that never occur
    b"\xf4\x90\x80\x80", b"\xf5\x80\x80\x80", b"\xf7\xbf\xbf\xbf", b"\xfb\xbf\xbf\xbf\xbf",
    b"\xfd\xbf\xbf\xbf\xbf\xbf", b"\xfe", b"\xff", b"\xfe\xfe\xff\xff",
    # far into a message
    b"x" * 1000 + b"\xff", b"x" * 999 + b"\xc3", "\u20ac".encode() * 300 + b"\xe2\x82")


def invalid_utf8():
    for text in invalid_texts:
        shown = f"{text[-8:]!r} ({len(text)} bytes)"
        yield case("8.1", f"the text {shown}", [frame(TEXT, text)], code=1007)
        if len(text) < 20:
            yield case("8.1", f"the text {shown} byte by byte", cut(TEXT, text, [1] * len(text)), code=1007)
            yield case("8.1", f"the text {shown} between pings",
                       [frame(TEXT, hello, fin=False), frame(PING, hello), frame(CONTINUATION, text)],
                       [(PONG, hello)], 1007)
    yield case("8.1", "a message, then one that ends inside a character",
               [frame(TEXT, hello), frame(TEXT, b"\xe2\x82")], [(TEXT, hello)], 1007)
    yield case("8.1", "a character over the end of a message",
               [frame(TEXT, b"\xe2\x82"), frame(TEXT, b"\xac")], code=1007)


def endings():
    """All cases after which the connection is over."""
    return [*masks(), *reserved_bits(), *opcodes(), *lengths(), *fragments_out_of_order(), *control_frames(),
            *closes(), *invalid_utf8()]


def shapes(payload, opcode=TEXT):
    """(section, name, script) for each way to send one message."""
    size = len(payload)
    yield "5.6", "whole", [frame(opcode, payload)]
    for key in (b"\0\0\0\0", b"\xff\xff\xff\xff", b"\1\2\3\4", b"\0\xff\0\xff", b"\x80\0\0\0"):
        yield "5.3", f"with the mask {key.hex()}", [frame(opcode, payload, key=key)]
    for each in (1, 2, 3, 7, 64):
        yield "5.4", f"in fragments of {each}", cut(opcode, payload, [each] * min(size // each, 1000))
    yield "5.4", "in two halves", cut(opcode, payload, [size // 2])
    yield "5.4", "behind an empty fragment", cut(opcode, payload, [0])
    yield "5.4", "before an empty fragment", cut(opcode, payload, [size])
    yield "5.4", "with empty fragments around and inside", cut(opcode, payload,
                                                               [0, 0, size // 2, 0, 0, size, 0])
    for control in (PING, PONG):
        parts = cut(opcode, payload, [size // 3, size // 3])
        yield "5.5", f"with a {names(control)} between fragments", [
            parts[0], frame(control, hello), parts[1], frame(control), parts[2]]
        yield "5.5", f"between two of {names(control)}", [
            frame(control, b"1"), frame(opcode, payload), frame(control, b"2")]
    yield "5.5", "with a ping of 125 bytes behind each byte of the first hundred", [
        one for part in cut(opcode, payload, [1] * min(size, 100)) for one in (part, frame(PING, b"p" * 125))]


def published():
    """(name, way to send, script, body) for each way to publish each of these bodies on /t."""
    bodies = ({"n": 1}, {"text": "\u00e9\u20ac\U0001f916" * 30}, {"long": "x" * 900})
    for body, way in itertools.product(bodies, ("send", "send_bytewise")):
        text = json.dumps({"op": "publish", "topic": "/t", "msg": body}, ensure_ascii=False)
        for section, name, script in shapes(text.encode()):
            yield f"{section}: {name}, {way}", way, script, body


def pongs_of(script):
    return [(PONG, one.payload) for one in script if one.opcode == PING]


def replies_of(script):
    """What an echo says to a script without faults."""
    said, message, opcode = [], b"", None
    for one in script:
        if one.opcode == PING:
            said.append((PONG, one.payload))
        elif one.opcode in (TEXT, BINARY, CONTINUATION):
            opcode, message = (opcode, message + one.payload) if one.opcode == CONTINUATION else (
                one.opcode, one.payload)
            if one.fin:
                said.append((opcode, message))
    return said


def echoes():
    """All cases that an echo sends back, and after which the connection goes on."""
    def good(section, name, script):
        return case(section, name, script, replies_of(script))

    for opcode in (TEXT, BINARY):
        for section, name, script in shapes(b"0123456789" * 20, opcode):
            yield good(section, f"{names(opcode)} {name}", script)
        for size in (0, 1, 2, 3, 4, 5, 7, 8, 9, 124, 125, 126, 127, 128, 255, 256, 4095, 4096, 4097, 65534,
                     65535, 65536, 65537, 100000):
            yield good("5.2", f"{names(opcode)} of {size} bytes", [frame(opcode, b"*" * size)])
        yield good("5.4", f"an empty {names(opcode)} in empty fragments", cut(opcode, b"", [0, 0, 0]))
    yield good("5.6", "binary of all bytes", [frame(BINARY, bytes(range(256)))])
    yield good("5.6", "binary that is not UTF-8, byte by byte", cut(BINARY, b"\xff\xfe\xc0\x80", [1] * 4))
    for size in (0, 1, 2, 124, 125):
        yield good("5.5.2", f"a ping of {size} bytes", [frame(PING, bytes(range(size)))])
    yield good("5.5.2", "a ping that is not UTF-8", [frame(PING, b"\xfe\xff\x00")])
    yield good("5.5.2", "ten pings at once", [frame(PING, bytes([n])) for n in range(10)])
    yield good("5.5.2", "a thousand pings at once", [frame(PING, b"%d" % n) for n in range(1000)])
    for size in (0, 1, 125):
        yield good("5.5.3", f"an unasked pong of {size} bytes", [frame(PONG, bytes(size)), frame(PING, b"!")])
    yield good("5.5.3", "a thousand unasked pongs", [frame(PONG, b"%d" % n) for n in range(1000)])
    yield good("5.4", "a thousand fragments with pongs between", [
        one for part in cut(TEXT, b"y" * 1000, [1] * 1000) for one in (part, frame(PONG))])
    yield good("5.6", "a hundred messages at once",
               [frame((TEXT, BINARY)[n % 2], b"%d" % n * n) for n in range(100)])
    for text in valid_texts:
        yield good("8.1", f"the text {text!r}", [frame(TEXT, text)])
        yield good("8.1", f"the text {text!r} byte by byte", cut(TEXT, text, [1] * len(text)))
        yield good("8.1", f"the text {text!r} cut anywhere",
                   [one for at in range(len(text) + 1) for one in cut(TEXT, text, [at])])
        yield good("8.1", f"the text {text!r} with a ping in each character",
                   [one for part in cut(TEXT, text, [1] * len(text)) for one in (part, frame(PING, b"?"))])

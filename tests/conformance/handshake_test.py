# SPDX-License-Identifier: Apache-2.0
"""The handshake in the server's role (RFC 6455 4.2), HTTP, and what is not HTTP, against `transport_echo` and
`rowe serve`. Whatever is wrong is answered with its status, never with 101, and the stream ends."""
import base64
import contextlib
import os
import ssl
import time
import unittest

import programs
from frames import CLOSE, PING, PONG, frame, stream
from programs import KEY, accept_of, read_answer, upgrade


def lines(*text):
    return "\r\n".join([*text, "", ""]).encode("latin-1")


# name -> the request, given the port. All of them are answered 101.
good_requests = {
    "as it should be": upgrade,
    "names in small letters": lambda p: b"\r\n".join(
        line if b": " not in line else line.partition(b":")[0].lower() + b":" + line.partition(b":")[2]
        for line in upgrade(p).split(b"\r\n")),
    "names in capitals": lambda p: upgrade(p).replace(b"Sec-WebSocket-Key", b"SEC-WEBSOCKET-KEY"),
    "no blanks behind the colons": lambda p: upgrade(p).replace(b": ", b":"),
    "blanks and tabs around values": lambda p: upgrade(p).replace(b": ", b": \t ").replace(
        b"13\r", b"13 \t\r"),
    "Upgrade in other letters": lambda p: upgrade(p, Upgrade="WebSocket"),
    "Connection in other letters": lambda p: upgrade(p, Connection="UPGRADE"),
    "Connection as a list": lambda p: upgrade(p, Connection="keep-alive, Upgrade"),
    "Connection as a list with holes": lambda p: upgrade(p, Connection=", keep-alive ,,upgrade,"),
    "Connection in two lines": lambda p: upgrade(p, "Connection: Upgrade", Connection="keep-alive"),
    "a path": lambda p: upgrade(p, target="/a/b"),
    "a query": lambda p: upgrade(p, target="/?a=b&c=/d?e"),
    "a path of 1000 bytes": lambda p: upgrade(p, target="/" + "x" * 999),
    "fields nobody knows": lambda p: upgrade(p, "X-A: 1", "X-A: 2", "Cookie: a=b", "DNT: 1"),
    "a field of 3000 bytes": lambda p: upgrade(p, "X-Long: " + "x" * 3000),
    "a field that is not ASCII": lambda p: upgrade(p, "X-Name: M\xfcller"),
    "an empty field": lambda p: upgrade(p, "X-Empty:"),
    "a header of 4096 bytes": lambda p: upgrade(p, "X-Long: " + "x" * (4096 - len(upgrade(p)) - 10)),
    "no body": lambda p: upgrade(p, "Content-Length: 0"),
    "permessage-deflate": lambda p: upgrade(
        p, "Sec-WebSocket-Extensions: permessage-deflate; client_max_window_bits"),
    "permessage-deflate offered forty times": lambda p: upgrade(
        p, "Sec-WebSocket-Extensions: " + ", ".join(["permessage-deflate; client_max_window_bits=10"] * 40)),
    "extensions nobody knows": lambda p: upgrade(p, "Sec-WebSocket-Extensions: x-a, x-b; c=\"d\""),
    "a key with bits that count for nothing": lambda p: upgrade(p, Sec_WebSocket_Key="A" * 21 + "B=="),
    "Host localhost": lambda p: upgrade(p, Host=f"localhost:{p}"),
    "Host in capitals": lambda p: upgrade(p, Host=f"LOCALHOST:{p}"),
    "Host without port": lambda p: upgrade(p, Host="127.0.0.1"),
    "Host of IPv6": lambda p: upgrade(p, Host=f"[::1]:{p}"),
    "the own Origin": lambda p: upgrade(p, Origin=f"{programs.HTTP}://127.0.0.1:{p}"),
    "the own Origin by another name": lambda p: upgrade(p, Origin=f"{programs.HTTP}://localhost:{p}"),
}

# name -> (status, request given the port).
bad_requests = {}


def bad(status, name, request):
    assert name not in bad_requests, name
    bad_requests[name] = status, request


# 4.1, 1st and 2nd point: GET, HTTP/1.1
for method in ("POST", "PUT", "DELETE", "OPTIONS", "TRACE", "PATCH", "get", "GETT", "HEAD", "BREW"):
    bad(405, f"4.1.2: {method}", lambda p, m=method: upgrade(p, method=m))
for method in ("", "G(T", "G\tT", "\xe9"):
    bad(400, f"4.1.2: the method {method!r}", lambda p, m=method: upgrade(p, method=m))
for version, status in (("HTTP/1.0", 505), ("HTTP/0.9", 505), ("HTTP/1.2", 505), ("HTTP/2", 505),
                        ("HTTP/2.0", 505), ("HTTP/1.10", 505), ("HTTP/3", 505), ("http/1.1", 400),
                        ("HTTP", 400), ("", 400), ("HTTP/1.1 x", 400), ("ICY/1.1", 400), ("HTTP/1.1 ", 400)):
    bad(status, f"4.1.2: the version {version!r}", lambda p, v=version: upgrade(p, version=v))
bad(400, "HTTP/0.9", lambda p: lines("GET /"))
bad(400, "only a method", lambda p: lines("GET"))
for target in ("", "*", "x", "127.0.0.1", "//\x7f", "/\xfc", "/a b", "/#here", "/\x00", "ws://127.0.0.1/",
               "http://evil.example/"):
    bad(400, f"4.1.3: the target {target!r}", lambda p, t=target: upgrade(p, target=t))

# 4.2.1, 2nd point: Host
bad(400, "4.2.1.2: no Host", lambda p: upgrade(p, Host=None))
bad(400, "4.2.1.2: two Hosts", lambda p: upgrade(p, f"Host: 127.0.0.1:{p}"))
bad(400, "4.2.1.2: two Hosts that differ", lambda p: upgrade(p, "Host: evil.example"))
for host in ("", "127.0.0.1:", "127.0.0.1:x", "127.0.0.1:0", "127.0.0.1:65536",
             "127.0.0.1:99999999999999999999", "127.0.0.1:-1", "[::1", "::1]", "[::1]x", "a b", "a/b",
             "user@127.0.0.1", "127.0.0.1,127.0.0.1", "127.0.0.1#", "127.0.0.1?", "\\"):
    bad((400, 403), f"4.2.1.2: the Host {host!r}", lambda p, h=host: upgrade(p, Host=h))
for host in ("evil.example", "evil.example:{p}", "localhost.evil.example:{p}", "127.0.0.1.evil.example:{p}",
             "127.0.0.2:{p}", "0.0.0.0:{p}", "localhost.:{p}", "2130706433:{p}", "0x7f.1:{p}", "[::]:{p}",
             "[::ffff:127.0.0.1]:{p}", "127.0.0.1:1", "localhost:1"):
    bad(403, f"10.2: the Host {host}", lambda p, h=host: upgrade(p, Host=h.format(p=p)))

# 4.2.1, 3rd and 4th: Upgrade, Connection
bad(426, "4.2.1.3: no Upgrade", lambda p: upgrade(p, Upgrade=None))
for value in ("", "h2c", "websocket, h2c", "h2c, websocket", "websockets", "web socket", "websocket/13",
              "TLS/1.0"):
    bad(400, f"4.2.1.3: Upgrade: {value}", lambda p, v=value: upgrade(p, Upgrade=v))
bad(400, "4.2.1.3: two Upgrades", lambda p: upgrade(p, "Upgrade: websocket"))
bad(400, "4.2.1.4: no Connection", lambda p: upgrade(p, Connection=None))
for value in ("", "close", "keep-alive", "Upgraded", "Up grade", "Upgrade;q=1"):
    bad(400, f"4.2.1.4: Connection: {value}", lambda p, v=value: upgrade(p, Connection=v))

# 4.2.1, 5th: the key
bad(400, "4.2.1.5: no key", lambda p: upgrade(p, Sec_WebSocket_Key=None))
bad(400, "4.2.1.5: two keys", lambda p: upgrade(p, f"Sec-WebSocket-Key: {KEY}"))
for size in (0, 1, 3, 14, 15, 17, 18, 24, 32, 300):
    bad(400, f"4.2.1.5: a key of {size} bytes",
        lambda p, n=size: upgrade(p, Sec_WebSocket_Key=base64.b64encode(bytes(n)).decode()))
for key in (KEY[:-2], KEY[:-1], KEY + "=", "=" * 24, KEY.replace("A", "*"), KEY.replace("A", "-"),
            KEY[:10] + " " + KEY[10:], "x" * 24, "dGhlIHNhbXBsZSBub25jZQ"):
    bad(400, f"4.2.1.5: the key {key!r}", lambda p, k=key: upgrade(p, Sec_WebSocket_Key=k))

# 4.2.1, 6th, and 4.4: the version; the answer names the one that is spoken
bad(426, "4.4: no version", lambda p: upgrade(p, Sec_WebSocket_Version=None))
for version in ("", "0", "6", "7", "8", "12", "14", "25", "99", "255", "256", "13, 8", "8, 13", "013", "+13",
                "13.0", "0x0d", "thirteen", "-13", "1 3"):
    bad(426, f"4.4: version {version!r}", lambda p, v=version: upgrade(p, Sec_WebSocket_Version=v))
bad(400, "4.4: two versions", lambda p: upgrade(p, "Sec-WebSocket-Version: 13"))

# 4.2.1, 7th, and 10.2: Origin
for origin in ("http://evil.example", "http://evil.example:{p}", "https://evil.example", "null", "NULL", "",
               "http://127.0.0.1", "http://127.0.0.1:1", "http://127.0.0.1:{p}.evil.example",
               "http://127.0.0.1:{p}@evil.example", "http://127.0.0.1.evil.example:{p}", "file://",
               "//127.0.0.1:{p}", "127.0.0.1:{p}", "http://", "ftp://127.0.0.1:{p}", "ws://127.0.0.1:{p}",
               "http://127.0.0.2:{p}",
               "http://localhost:{p}, http://evil.example", "http://localhost:{p} http://evil.example",
               "chrome-extension://abcdef", "http://localhost.evil.example:{p}",
               "http://evil.example/localhost:{p}"):
    bad(403, f"10.2: Origin: {origin}", lambda p, o=origin: upgrade(p, Origin=o.format(p=p)))
bad(400, "10.2: two Origins", lambda p: upgrade(
    p, "Origin: http://evil.example", Origin=f"http://127.0.0.1:{p}"))
bad(403, "10.2: a name made to point here", lambda p: upgrade(
    p, Host=f"evil.example:{p}", Origin=f"http://evil.example:{p}"))

# 4.2.1, 8th: subprotocols
for offer in ("chat", "chat, superchat", "a b", "\"chat\"", "chat/1", "(chat)"):
    bad(400, f"4.2.1.8: the subprotocol {offer}", lambda p, o=offer: upgrade(p, Sec_WebSocket_Protocol=o))

# HTTP: bodies, lines, other protocols
for field in ("Content-Length: 5", "Content-Length: -1", "Content-Length: x", "Content-Length:",
              "Content-Length: +0", "Transfer-Encoding: chunked", "Transfer-Encoding: identity",
              "Content-Length: 0\r\nContent-Length: 0",
              "Content-Length: 0\r\nTransfer-Encoding: chunked"):
    bad(400, f"a body: {field!r}", lambda p, f=field: upgrade(p, f))
for name, line in (("folded", "X: a\r\n b"), ("folded by a tab", "X: a\r\n\tb"), ("without colon", "nothing"),
                   ("blank before the colon", "X : a"), ("without name", ": a"),
                   ("name with blanks", "X Y: a"), ("name not ASCII", "\xfc: a"),
                   ("NUL in the value", "X: \0"), ("NUL in the name", "X\0Y: a"),
                   ("bell", "X: \a"), ("DEL", "X: \x7f"), ("a carriage return inside", "X: a\rb"),
                   ("a bare line feed", "X: a\nY: b"), ("a blank line's beginning", "\r")):
    bad(400, f"a field, {name}", lambda p, one=line: upgrade(p, one))
bad(400, "bare line feeds", lambda p: upgrade(p).replace(b"\r\n", b"\n"))
bad(400, "an empty line first", lambda p: b"\r\n" + upgrade(p))
bad(400, "blanks first", lambda p: b"  " + upgrade(p))
bad(400, "two blanks in the request line", lambda p: upgrade(p).replace(b"GET /", b"GET  /"))
bad(400, "tabs in the request line", lambda p: upgrade(p).replace(b"GET / ", b"GET\t/\t"))
bad(400, "a folded request line", lambda p: upgrade(p).replace(b"GET / ", b"GET /\r\n "))
bad(431, "a header of 4097 bytes", lambda p: upgrade(p, "X-Long: " + "x" * (4097 - len(upgrade(p)) - 10)))
bad(431, "a header of 100000 bytes", lambda p: upgrade(p, "X-Long: " + "x" * 100000))
bad(431, "a line without end", lambda p: b"GET /" + b"x" * 10000)
bad(431, "a thousand fields", lambda p: upgrade(p, *[f"X-{n}: {n}" for n in range(1000)]))
bad(400, "h2c", lambda p: upgrade(p, "HTTP2-Settings: AAMAAABkAAQAAP__", Upgrade="h2c",
                                  Connection="Upgrade, HTTP2-Settings", Sec_WebSocket_Key=None,
                                  Sec_WebSocket_Version=None))
bad(505, "HTTP/2 with prior knowledge", lambda p: b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + bytes(9))
bad(405, "CONNECT", lambda p: lines(f"CONNECT 127.0.0.1:{p} HTTP/1.1", f"Host: 127.0.0.1:{p}"))
bad(405, "CONNECT of a WebSocket (RFC 8441)", lambda p: lines(
    "CONNECT / HTTP/1.1", f"Host: 127.0.0.1:{p}", "protocol: websocket", "Sec-WebSocket-Version: 13"))
bad(400, "a greeting of SSH", lambda p: b"SSH-2.0-OpenSSH_9.2\r\n\r\n")
bad(400, "a greeting of SMTP", lambda p: b"EHLO x\r\n\r\n")
bad(400, "empty lines", lambda p: b"\r\n\r\n\r\n\r\n")
bad(400, "line feeds", lambda p: b"\n\n")
bad((400, 431), "noise", lambda p: bytes(range(256)) * 40)
bad((400, 431), "frames instead", lambda p: frame(PING, b"\r\n\r\n", key=bytes(4)).to_bytes(True))


def rest_of(s, begin=b""):
    """What comes until the end of the stream."""
    with contextlib.suppress(ConnectionResetError):
        while piece := s.recv(65536):
            begin += piece
    return begin


class matrix(unittest.TestCase):
    def test_what_is_right_is_switched(self):
        for serving in programs.servers():
            for name, request in good_requests.items():
                for step in (1 << 20, 1):
                    with self.subTest(f"{serving.kind}: {name}, {step} bytes a time"):
                        self.switches(serving, request(serving.port), step)
        print(f"handshakes: {len(good_requests)} good ones", flush=True)

    def switches(self, serving, data, step=1 << 20):
        with serving.dial() as s:
            for at in range(0, len(data), step):
                s.sendall(data[at:at + step])
            status, fields, rest = read_answer(s)
            self.assertEqual(status, 101)
            self.assertEqual(fields["upgrade"].lower(), "websocket")  # 4.2.2, 5th point
            self.assertEqual(fields["connection"].lower(), "upgrade")
            self.assertNotIn("sec-websocket-extensions", fields)
            self.assertNotIn("content-length", fields)
            peer = stream(s, peer_masks=False, begin=rest)
            peer.send(frame(PING, b"?"), frame(CLOSE))
            self.assertEqual(peer.until_close()[0], [(PONG, b"?")])
            peer.until_end()
            return fields

    def test_what_is_wrong_is_refused(self):
        for serving in programs.servers():
            for name, (status, request) in bad_requests.items():
                for how in ("at once", "in pieces", "with a right one behind it"):
                    with self.subTest(f"{serving.kind}: {name}, {how}"):
                        self.refused(serving, status, request(serving.port), how)
        print(f"handshakes: {len(bad_requests)} bad ones", flush=True)

    def refused(self, serving, status, data, how):
        with serving.dial() as s:
            with contextlib.suppress(BrokenPipeError, ConnectionResetError):
                if how == "in pieces":
                    for at in range(0, len(data), 97):
                        s.sendall(data[at:at + 97])
                else:
                    s.sendall(data + (upgrade(serving.port) if how != "at once" else b""))
            got, fields, rest = read_answer(s)
            self.assertIn(got, status if isinstance(status, tuple) else (status,))
            self.assertEqual(fields["connection"], "close")
            if got == 426:
                self.assertEqual(fields["sec-websocket-version"], "13")
                self.assertEqual(fields["upgrade"], "websocket")
            if got == 405:
                self.assertEqual(fields["allow"], "GET, HEAD")
            body = rest_of(s, rest)
            length = 0 if data.startswith(b"HEAD") else int(fields["content-length"])
            self.assertEqual(len(body), length, "one answer, and then the end")
            if length:
                self.assertTrue(body.endswith(b"\n") and body.isascii() and body.decode().isprintable
                                and all(0x20 <= byte < 0x7f or byte == 10 for byte in body))

    def test_keys_are_answered_by_their_hash(self):  # 4.2.2, 5.4
        with programs.server("echo") as serving:
            for key in ("dGhlIHNhbXBsZSBub25jZQ==", *(base64.b64encode(os.urandom(16)).decode()
                                                      for _ in range(100))):
                fields = self.switches(serving, upgrade(serving.port, Sec_WebSocket_Key=key))
                self.assertEqual(fields["sec-websocket-accept"], accept_of(key), key)
            self.assertEqual(accept_of("dGhlIHNhbXBsZSBub25jZQ=="), "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=")  # 1.3

    def test_subprotocols(self):  # 4.2.2, 5.5: the first one offered that is known
        with programs.server("echo", "--subprotocol", "a.v1", "--subprotocol", "b.v1") as serving:
            for offers, chosen in ((["a.v1"], "a.v1"), (["b.v1"], "b.v1"), (["b.v1, a.v1"], "b.v1"),
                                   (["x, b.v1"], "b.v1"), (["b.v1", "a.v1"], "b.v1"), (["x", "a.v1"], "a.v1"),
                                   (["x,y,,a.v1"], "a.v1"), ([], None)):
                with self.subTest(offers):
                    more = [f"Sec-WebSocket-Protocol: {offer}" for offer in offers]
                    fields = self.switches(serving, upgrade(serving.port, *more))
                    self.assertEqual(fields.get("sec-websocket-protocol"), chosen)
            for offer in ("c.v1", "A.V1", "a", "a.v1.x", "a.v1, b c"):
                with self.subTest(offer):
                    self.refused(serving, 400, upgrade(serving.port, Sec_WebSocket_Protocol=offer), "at once")

    def test_without_an_upgrade_it_is_http(self):
        for serving in programs.servers():
            page = {"echo": 404, "hub": 200}[serving.kind]
            for target, method, status in (("/", "GET", page), ("/", "HEAD", page), ("/no/such", "GET", 404)):
                with self.subTest(f"{serving.kind}: {method} {target}"), serving.dial() as s:
                    request = lines(f"{method} {target} HTTP/1.1", f"Host: 127.0.0.1:{serving.port}")
                    s.sendall(request + upgrade(serving.port))  # what is behind it is not heard
                    got, fields, rest = read_answer(s)
                    self.assertEqual(got, status)
                    length = 0 if method == "HEAD" else int(fields["content-length"])
                    self.assertEqual(len(rest_of(s, rest)), length)

    def test_bytes_behind_the_handshake_are_frames(self):
        early = frame(PING, b"early").to_bytes(True)
        for serving in programs.servers():
            for behind in (early, early * 100, early[:3], frame(3).to_bytes(True), upgrade(serving.port)):
                with self.subTest(f"{serving.kind}: {behind[:10]}"), serving.connect(behind) as s:
                    if behind == early[:3]:
                        s.socket.sendall(early[3:])
                    if behind.startswith(early[:3]):
                        self.assertEqual(s.event(), (PONG, b"early"))
                    else:
                        self.assertEqual(s.until_close()[1], 1002)


class timeouts(unittest.TestCase):
    def test_who_does_not_come_to_the_point_is_cut(self):
        """All at the same time, because it takes seconds by the clock. What is demanded is a lower end."""
        half = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n"

        def waits(serving, begun, answers, drip=b""):
            begin = time.monotonic()
            with serving.dial() as s:
                s.sendall(begun)
                with contextlib.suppress(BrokenPipeError, ConnectionResetError):
                    for byte in drip:
                        programs.pause(s, 1)  # an answer ends it early
                        s.sendall(bytes([byte]))
                self.assertIn(read_answer(s)[0], answers)
            self.assertGreater(time.monotonic() - begin, 4.5)

        with programs.server("echo") as echo, programs.server("hub") as hub:
            jobs = [(f"{one.kind}: {name}", lambda _, arguments=(one, *how): waits(*arguments))
                    for one in (echo, hub) for name, *how in (
                        ("nothing", b"", (None,), b""),
                        ("half a header", half, (408,), b""),
                        ("a byte a second", b"", (408, None), upgrade(one.port)[:20]),
                        ("half a header, then a byte a second", half, (408, None), b"X-Loris: 1234567890"))]
            programs.in_parallel(jobs, len(jobs))

    @unittest.skipIf(programs.TLS, "it is about a port that does not speak TLS")
    def test_a_tls_client_is_answered_in_its_own_protocol(self):
        for one in programs.servers():
            with self.subTest(one.kind), one.dial() as s:
                with self.assertRaises(ssl.SSLError) as caught:
                    ssl.create_default_context().wrap_socket(s, server_hostname="x")
                self.assertIn("HANDSHAKE_FAILURE", caught.exception.reason)


if __name__ == "__main__":
    unittest.main()

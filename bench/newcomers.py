#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""usage: newcomers.py [--addresses=200] [--rate=2000] [--newcomers=20] [--rtt=10,30,100]

Question: who gets in while 200 addresses hold each handshake they get, and come again when they lose it?

A robot, and a network with that round trip (tests/impair) between it and everybody else. The flood begins
`rate` connections a second from `addresses`. Each says a whole ClientHello (in plain TCP the first line of a
request) and nothing more. Meanwhile `newcomers` come one after the other from an address of their own, with a
token: to the endpoint, and to /rowe/stop, where each asks for a stop. Printed is how many were in within a
second (the stop: were answered), the median and the longest, and of the stop that time without the three
round trips that TCP, TLS 1.3 and the upgrade take (two without TLS) and one for the stop itself.

Excluded: who comes in while the network itself is full. What would make it lie: a flood that does not reach
its rate, so what it reached is printed.

Needs what tests/impair needs, and in ROWE_BIN the program rowe (build/release/bin/rowe unless stated).
"""
import argparse
import contextlib
import os
import selectors
import socket
import ssl
import statistics
import subprocess
import sys
import threading
import time

here = os.path.dirname(os.path.abspath(__file__))
top = os.path.dirname(here)
os.environ.setdefault("ROWE_BIN", os.path.join(top, "build", "release", "bin", "rowe"))
sys.path[:0] = [os.path.join(top, "tests", folder) for folder in ("tools", "impair", "faults")]

import bad_network  # noqa: E402
import link  # noqa: E402
import robot as robots  # noqa: E402
import websocket  # noqa: E402

host = link.address["a"]
in_time = 1.0


def flood(port, addresses, rate, said):
    """Until its input ends. Then prints how many it has begun, and in how many seconds."""
    watched, begun, places = selectors.DefaultSelector(), 0, [*range(1, addresses + 1)] * 4
    held, started = {}, time.monotonic()
    missed = 0  # is not made up for
    over = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), over.set()), daemon=True).start()
    while not over.is_set():
        due = int((time.monotonic() - started) * rate) - missed
        missed += max(due - begun - rate // 100, 0)
        while begun < due and places:
            number = places.pop()
            one = socket.socket()
            one.setblocking(False)
            one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
            one.bind((f"10.98.77.{number}", 0))
            with contextlib.suppress(BlockingIOError):
                one.connect((host, port))
            watched.register(one, selectors.EVENT_WRITE)
            held[one], begun = number, begun + 1
        for key, events in watched.select(0.0005):
            one, over_now = key.fileobj, True
            with contextlib.suppress(OSError):
                if events & selectors.EVENT_WRITE:
                    one.send(said)
                    watched.modify(one, selectors.EVENT_READ)
                    over_now = False
                else:
                    over_now = not one.recv(65536)
            if over_now:
                watched.unregister(one)
                one.close()
                places.insert(0, held.pop(one))
    print(begun, time.monotonic() - started)


def hello(trust):
    incoming, outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
    client = trust.wrap_bio(incoming, outgoing, server_hostname=host)
    with contextlib.suppress(ssl.SSLWantReadError):
        client.do_handshake()
    return outgoing.read()


def measure(arguments, tls, rtt):
    with contextlib.ExitStack() as everything:
        enter = everything.enter_context
        between = enter(bad_network.network(f"delay={rtt / 2}ms"))
        device = link_of(between, "b")
        for number in range(1, arguments.addresses + 1):
            ip(between, "b", "addr", "add", f"10.98.77.{number}/32", "dev", device)
        ip(between, "a", "route", "add", "10.98.77.0/24", "dev", link_of(between, "a"))
        bot = enter(robots.robot("--host", host))
        inside = ("ip", "netns", "exec", between.namespace("a"), robots.program.ROWE)
        if tls:
            serving = enter(bot.serving("--demo", address=host, command=inside))
        else:
            serving = enter(robots.program.hub("--demo", "--address", host, "--insecure", command=inside))
        said = hello(bot.trust()) if tls else b"GET / HTTP/1.1\r\n"
        others = between.start("b", sys.executable, __file__, f"--flood={serving.port}",
                               f"--addresses={arguments.addresses}", f"--rate={arguments.rate}", said.hex())
        threading.Event().wait(2)

        def peer(path):
            return websocket.peer(serving.port, host, path, secure=bot.trust() if tls else None,
                                  headers={"Authorization": f"Bearer {bot.tokens['driver']}"} if tls else {})

        def comes(path):
            begin = time.monotonic()
            try:
                with peer(path) as p:
                    if path != "/":
                        p.send({"op": "call_service", "service": "/rowe/stop", "id": "now"})
                        p.receive_until(lambda m: m["op"] == "service_response")
                    return time.monotonic() - begin
            except (OSError, websocket.closed):
                return None

        for path in ("/", "/rowe/stop"):
            took = [between.call("b", comes, path) for _ in range(arguments.newcomers)]
            there = [t for t in took if t is not None]
            median = statistics.median(there) * 1000 if there else 0
            longest = max(there, default=0) * 1000
            within = sum(t <= in_time for t in there)
            line = (f"{'TLS' if tls else 'TCP'}, round trip {rtt} ms, {path:10}: {within} of {len(took)} in, "
                    f"median {median:.0f} ms, longest {longest:.0f} ms")
            if path != "/":
                trips = 4 if tls else 3
                line += (f"; without {trips} round trips {median - trips * rtt:.0f} and "
                         f"{longest - trips * rtt:.0f} ms")
            print(line, flush=True)
        said, _ = others.communicate()
        begun, seconds = map(float, said.split())
        print(f"  the flood: {begun / seconds:.0f} connections a second", flush=True)


def ip(between, side, *words):
    return subprocess.run(["ip", "-n", between.namespace(side), *words], check=True, capture_output=True,
                          text=True).stdout


def link_of(between, side):
    words = ip(between, side, "-o", "link")
    return next(line.split(": ")[1].split("@")[0] for line in words.splitlines() if ": lo:" not in line)


def main():
    read = argparse.ArgumentParser()
    read.add_argument("--addresses", type=int, default=200)
    read.add_argument("--rate", type=int, default=2000)
    read.add_argument("--newcomers", type=int, default=20)
    read.add_argument("--rtt", default="10,30,100")
    read.add_argument("--flood", type=int)
    read.add_argument("said", nargs="?", default="")
    arguments = read.parse_args()
    if arguments.flood:
        return flood(arguments.flood, arguments.addresses, arguments.rate, bytes.fromhex(arguments.said))
    why_not = bad_network.why_not()
    if why_not:
        sys.exit(why_not)
    for tls in (True, False):
        for rtt in arguments.rtt.split(","):
            measure(arguments, tls, float(rtt))


main()

# SPDX-License-Identifier: Apache-2.0
"""peer.py HOST PORT: a peer in a process of its own, to be stopped, killed and cut off. Answers pings; to
each line of input it makes a round trip and says `heard`; says `open PORT` first and `over WHY` when cut.
The line `reset` makes it vanish as a host does that restarts: no close frame, a reset, and no memory of the
connection."""
import contextlib
import select
import socket
import struct
import sys

import websocket

nonce = b"still there?"


def run(p):
    print("open", p.stream.getsockname()[1], flush=True)
    while True:
        # What was read ahead is read first.
        if not p.buffer and sys.stdin in select.select([p.stream, sys.stdin], [], [])[0]:
            line = sys.stdin.readline()
            if not line:
                return
            if line == "reset\n":
                p.stream.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                return
            p.send_frame(websocket.PING, nonce)
            continue
        _, opcode, payload = p.receive_frame()
        if opcode == websocket.PING:
            with contextlib.suppress(OSError):  # cut off meanwhile; what came before it is still to be read
                p.send_frame(websocket.PONG, payload)
        elif opcode == websocket.PONG and payload == nonce:
            print("heard", flush=True)
        elif opcode == websocket.CLOSE:
            print("over", payload[2:].decode(), flush=True)
            return


with websocket.peer(int(sys.argv[2]), sys.argv[1]) as connected:
    run(connected)

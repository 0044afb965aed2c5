# SPDX-License-Identifier: Apache-2.0
"""A server of bench/peers (peers.hpp) on Debian's python3-websockets, without compression and pings; what
goes to everybody goes by its broadcast(), as its documentation advises."""
import argparse
import asyncio

import websockets

everybody = set()


async def echo(socket):
    async for message in socket:
        await socket.send(message)


async def fan_out(socket):
    everybody.add(socket)
    try:
        async for message in socket:
            websockets.broadcast(everybody, message)
    finally:
        everybody.discard(socket)


async def sink(socket):
    count = 0
    async for message in socket:
        count += 1
        if len(message) == 1:
            await socket.send(str(count))


async def flood(socket):
    message = await socket.recv()
    while True:
        await socket.send(message)


async def main(port, handler):
    async def serve(socket):
        try:
            await handler(socket)
        except (websockets.ConnectionClosed, OSError):
            pass  # the client went away

    async with websockets.serve(serve, "127.0.0.1", port, compression=None, ping_interval=None,
                                max_queue=None):
        await asyncio.Future()


parser = argparse.ArgumentParser()
parser.add_argument("--port", type=int, required=True)
parser.add_argument("--mode", choices=["echo", "flood", "sink", "fan_out"], required=True)
arguments = parser.parse_args()
asyncio.run(main(arguments.port, globals()[arguments.mode]))

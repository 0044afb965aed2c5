# SPDX-License-Identifier: Apache-2.0
"""A Python program drives the demo robot over a network that stalls and breaks: what it sent meanwhile, and
what it kept while it was offline, moves nothing. It has no ticks, as programs have that know nothing of them.

Skipped, with the reason, where Python has no package websockets.
"""
import asyncio
import contextlib
import json
import time
import unittest

from program import hub, run, timeout

try:
    import websockets
except ImportError:
    websockets = None

command = json.dumps({"op": "publish", "topic": "/cmd_vel", "msg": {"linear": {"x": 0.4}, "angular": {}}})
still = 0.01  # m/s


def setUpModule():
    if websockets is None:
        raise unittest.SkipTest("Python has no package websockets (Debian: python3-websockets)")


async def until(what, probe):
    end = time.monotonic() + timeout
    while not probe():
        assert time.monotonic() < end, what
        await asyncio.sleep(0.01)


class network:
    """Between the program and the robot: bytes pass, or wait."""

    def __init__(self):
        self.flows = asyncio.Event()
        self.flows.set()
        self.writers = set()

    async def begin(self):
        self.server = await asyncio.start_server(self.join, "127.0.0.1", 0)
        self.host = "127.0.0.1:%d" % self.server.sockets[0].getsockname()[1]

    async def join(self, reader, writer):
        to_robot = await asyncio.open_connection("127.0.0.1", self.port)
        self.writers |= {writer, to_robot[1]}
        await asyncio.gather(self.carry(reader, to_robot[1]), self.carry(to_robot[0], writer))

    async def carry(self, reader, writer):
        with contextlib.suppress(ConnectionError):
            while data := await reader.read(65536):
                await self.flows.wait()
                writer.write(data)
        writer.close()

    def cut(self):
        for one in self.writers:
            one.transport.abort()
        self.writers.clear()

    async def end(self):
        self.cut()
        self.server.close()


class driving(unittest.IsolatedAsyncioTestCase):
    async def asyncSetUp(self):
        self.network = network()
        await self.network.begin()
        robot = self.enterContext(hub("--demo", "--allow-host", self.network.host))
        self.network.port, url = robot.port, robot.url
        self.speed = None
        self.watcher = asyncio.create_task(self.watch(url))
        await self.let_run(url)
        autopilot = ("call", url, "/rosapi/set_param", '{"name":"/robot/autopilot","value":"false"}')
        (await asyncio.to_thread(run, *autopilot)).expect(0)
        await self.stands()

    async def asyncTearDown(self):
        self.watcher.cancel()
        await self.network.end()

    async def let_run(self, url):
        shown = await asyncio.to_thread(run, "reset", url)
        if shown.code != 0:
            await asyncio.to_thread(run, "reset", url, shown.stdout[0].split()[-1])

    async def watch(self, url):
        async with websockets.connect(url) as socket:
            await socket.send('{"op":"subscribe","topic":"/odom","throttle_rate":20}')
            async for message in socket:
                self.speed = abs(json.loads(message)["msg"]["twist"]["twist"]["linear"]["x"])

    async def stands(self):
        await until("it stands still", lambda: self.speed is not None and self.speed < still)

    async def fastest_within(self, seconds):
        fastest, end = 0, time.monotonic() + seconds
        while time.monotonic() < end:
            fastest = max(fastest, self.speed)
            await asyncio.sleep(0.01)
        return fastest

    async def drive(self, socket):
        """Twenty commands a second, until it moves. The package answers pings by itself."""
        end = time.monotonic() + timeout
        while self.speed < 0.1:
            assert time.monotonic() < end, "it moves"
            await socket.send(command)
            await asyncio.sleep(0.05)

    async def test_what_comes_out_of_a_stall_moves_nothing(self):
        async with websockets.connect(f"ws://{self.network.host}") as socket:
            await self.drive(socket)
            self.network.flows.clear()
            for _ in range(40):
                await socket.send(command)
                await asyncio.sleep(0.05)
            await self.stands()
            self.network.flows.set()
            self.assertLess(await self.fastest_within(1.5), still)
            await self.drive(socket)

    async def test_what_a_program_kept_while_it_was_offline_moves_nothing(self):
        async with websockets.connect(f"ws://{self.network.host}") as socket:
            await self.drive(socket)
            self.network.cut()
            await self.stands()
        async with websockets.connect(f"ws://{self.network.host}") as socket:
            for _ in range(40):  # all that it would have said
                await socket.send(command)
            self.assertLess(await self.fastest_within(1.5), still)
            await self.drive(socket)


if __name__ == "__main__":
    unittest.main()

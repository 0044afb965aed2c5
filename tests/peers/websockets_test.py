# SPDX-License-Identifier: Apache-2.0
"""Python's websockets at the other end, as a client and as a server, by either codec: with the program, and
with a robot in C++ (robot.cpp). It is what Python programs of today use, and shares no code with rowe.

Skipped, with the reason, where Python has no such package.
"""
import asyncio
import json
import signal
import unittest

from program import hub, run, timeout
from robot_test import robot

try:
    import websockets
except ImportError:
    websockets = None

sum_of = {"service": "add-two-numbers", "a": 38, "b": 4}


def setUpModule():
    if websockets is None:
        raise unittest.SkipTest("Python has no package websockets (Debian: python3-websockets)")


async def in_time(something):
    return await asyncio.wait_for(something, timeout)


async def rowe(*arguments, **how):
    """Runs the program to its end, beside what else is going on."""
    return await asyncio.to_thread(run, *arguments, **how)


class conversation:
    """One connection, of either side: JSON in, JSON out."""

    def __init__(self, socket):
        self.socket = socket
        self.past = []  # what was read and not asked for yet

    async def send(self, message):
        await in_time(self.socket.send(json.dumps(message)))

    async def receive(self):
        return json.loads(await in_time(self.socket.recv()))

    async def first(self, **wanted):
        """The first message, past or to come, with these members; it is taken out of the past."""
        def fits(message):
            return all(message.get(name) == value for name, value in wanted.items())

        for message in self.past:
            if fits(message):
                self.past.remove(message)
                return message
        while not fits(message := await self.receive()):
            self.past.append(message)
        return message


def timeless(message):
    """What rowe_echo says again, without what is left of its second to live."""
    assert 0 < message.pop("ttl_ms") < 1000, message
    return message


class against(unittest.IsolatedAsyncioTestCase):
    async def connected(self, port, **how):
        socket = await in_time(websockets.connect(f"ws://127.0.0.1:{port}/", **how))
        self.addAsyncCleanup(socket.close)
        return conversation(socket)

    async def listening(self, play=None, port=0, **how):
        """A server on a port of its own; `play(conversation)` with each who comes, until it returns."""
        self.failures = []

        async def guarded(socket):
            try:
                await play(conversation(socket))
            except websockets.ConnectionClosed:
                pass
            except Exception as failure:
                self.failures.append(failure)
                raise

        made = await in_time(websockets.serve(guarded, "127.0.0.1", port, **how))
        self.addAsyncCleanup(self.stop, made)
        self.port = made.sockets[0].getsockname()[1]
        self.url = f"ws://127.0.0.1:{self.port}/"
        return made

    async def stop(self, server):
        server.close()
        await in_time(server.wait_closed())
        if self.failures:
            raise self.failures[0]


class a_client_of_the_hub(against):
    def setUp(self):
        self.hub = self.enterContext(hub("--demo"))

    async def test_calls_the_robot(self):
        viewer = await self.connected(self.hub.port)
        for args, result in (({"speed": 0.5}, True), ({"speed": 5}, False)):
            await viewer.send({"op": "call_service", "id": "c", "service": "/robot/set_speed", "args": args})
            answer = await viewer.first(op="service_response", id="c")
            self.assertIs(answer["result"], result)
        self.assertIn("out of range", answer["values"])
        await viewer.send({"service": "/robot/set_speed", "speed": 0.5, "message_id": "m"})
        self.assertEqual(await viewer.first(in_reply_to="m"), {"speed": 0.5, "in_reply_to": "m"})

    async def test_provides_a_service(self):
        provider, asker = await self.connected(self.hub.port), await self.connected(self.hub.port)
        await provider.send({"op": "advertise_service", "service": "/add", "type": "demo/Add"})
        await provider.send({"op": "call_service", "id": "r", "service": "/rosapi/services"})
        listed = await provider.first(id="r")  # so it was read
        self.assertIn("/add", listed["values"]["services"])

        async def answer():
            asked = await provider.first(op="call_service", service="/add")
            values = {"sum": asked["args"]["a"] + asked["args"]["b"]}
            await provider.send({"op": "service_response", "id": asked["id"], "service": "/add",
                                 "values": values, "result": True})

        ended, _ = await asyncio.gather(rowe("call", self.hub.url, "/add", '{"a":38,"b":4}'), answer())
        self.assertEqual((ended.code, ended.stdout), (0, ['{"sum": 42}']), ended.stderr)  # as Python writes
        await asker.send({"op": "call_service", "id": 7, "service": "/add", "args": {"a": 1, "b": 2}})
        await answer()
        self.assertEqual((await asker.first(id=7))["values"], {"sum": 3})

        await asker.send({"op": "call_service", "id": 8, "service": "/add", "args": {"a": 1, "b": 2}})
        await provider.first(op="call_service")
        provider.socket.transport.abort()
        lost = await asker.first(id=8)
        self.assertEqual((lost["result"], lost["values"]), (False, "the peer went away"))

    async def test_publishes_to_another(self):
        one, other = await self.connected(self.hub.port), await self.connected(self.hub.port)
        await other.send({"op": "subscribe", "topic": "/chatter", "type": "std_msgs/String"})
        await other.send({"op": "call_service", "id": "r", "service": "/rosapi/topics"})
        await other.first(id="r")
        await one.send({"op": "advertise", "topic": "/chatter", "type": "std_msgs/String"})
        for i in range(50):
            await one.send({"op": "publish", "topic": "/chatter", "msg": {"data": f"é {i}"}})
        heard = [(await other.first(op="publish"))["msg"]["data"] for _ in range(50)]
        self.assertEqual(heard, [f"é {i}" for i in range(50)])

    async def test_sees_no_compression_its_pings_answered_and_a_close_frame(self):
        viewer = await self.connected(self.hub.port, compression="deflate")
        self.assertEqual(viewer.socket.extensions, [])
        await in_time(await viewer.socket.ping(b"are you there"))
        self.assertEqual(await asyncio.to_thread(self.hub.end, signal.SIGTERM), 0, self.hub.stderr)
        with self.assertRaises(websockets.ConnectionClosedOK) as closed:
            await viewer.receive()
        self.assertEqual(closed.exception.rcvd.code, 1001)


class a_client_of_a_robot(against):
    def setUp(self):
        self.robot = self.enterContext(robot("listen", "standard"))

    async def test_asks_it(self):
        asker = await self.connected(self.robot.port)
        for identity in ("m1", "é", 7, -1):
            await asker.send({**sum_of, "message_id": identity})
            self.assertEqual(await asker.first(in_reply_to=identity), {"result": 42, "in_reply_to": identity})
        await asker.send({"op": "call_service", "id": "c", "service": "/mine", "args": {"data": True}})
        self.assertEqual((await asker.first(id="c"))["values"], {"success": True, "message": "on"})

    async def test_hears_what_others_say(self):
        one, other = await self.connected(self.robot.port), await self.connected(self.robot.port)
        for each in (one, other):  # once it spoke plainly a peer is spoken to
            await each.send({**sum_of, "message_id": "hello"})
            await each.first(in_reply_to="hello")
        await one.send({"name": "é/😀"})
        for each in (one, other):
            self.assertEqual(timeless(await each.receive()), {"name": "é/😀"})
        await one.socket.send(['{"in', '":"fra', 'gments"}'])
        for each in (one, other):
            self.assertEqual(timeless(await each.receive()), {"in": "fragments"})

    async def test_offers_the_subprotocol(self):
        asker = await self.connected(self.robot.port, subprotocols=["rowe.v1"])
        self.assertEqual(asker.socket.subprotocol, "rowe.v1")


class a_server_for_the_program(against):
    async def test_answers_calls_by_either_codec(self):
        async def play(peer):
            while asked := await peer.receive():
                if "op" not in asked:
                    await peer.send({"result": asked["a"] + asked["b"], "in_reply_to": asked["message_id"]})
                elif asked["op"] == "call_service":
                    values = {"result": asked["args"]["a"] + asked["args"]["b"]}
                    await peer.send({"op": "service_response", "id": asked["id"], "result": True,
                                     "service": asked["service"], "values": values})

        await self.listening(play)
        for more in ((), ("--plain",)):
            ended = await rowe("call", self.url, "/add", '{"a":38,"b":4}', *more, code=0)
            self.assertEqual([json.loads(line) for line in ended.stdout], [{"result": 42}])
            await rowe("call", self.url, "/add", '{"a":38,"b":4}', "--repeat", "50", *more, code=0)

    async def test_publishes_to_it(self):
        async def play(peer):
            asked = await peer.first(op="subscribe", topic="/t")
            for i in range(20):
                await peer.send({"op": "publish", "topic": asked["topic"], "msg": {"i": i}})
            await peer.socket.wait_closed()

        await self.listening(play)
        ended = await rowe("echo", self.url, "/t", "--json", "-n", "20")
        self.assertEqual((ended.code, [json.loads(line)["i"] for line in ended.stdout]), (0, list(range(20))))

    async def test_gets_what_it_publishes(self):
        heard = asyncio.Queue()

        async def play(peer):
            while True:
                await heard.put(await peer.receive())

        await self.listening(play)
        ended = await rowe("pub", self.url, "/t", '{"data":"é"}', "--type", "std_msgs/String", code=0)
        # Before the message a call, which asks who has subscribed, and one behind all, whose answer would
        # prove that it was dealt with.
        first, asked, second, third, last = [await in_time(heard.get()) for _ in range(5)]
        self.assertEqual((first["op"], first["topic"], first["type"]), ("advertise", "/t", "std_msgs/String"))
        self.assertEqual((second["op"], second["topic"], second["msg"]), ("publish", "/t", {"data": "é"}))
        self.assertEqual([one["op"] for one in (asked, third, last)],
                         ["call_service", "unadvertise", "call_service"])
        self.assertRegex("\n".join(ended.stderr), "did not answer within")
        await rowe("pub", self.url, '{"plain":"é"}', "--plain", code=0)
        self.assertEqual(await in_time(heard.get()), {"plain": "é"})


class a_server_for_a_robot(against):
    """The robot is the client: it says what it provides each time that it comes."""

    async def check(self, peer):
        provided = [(await peer.first(op="advertise_service"))["service"] for _ in range(2)]
        self.assertEqual(sorted(provided), ["/mine", "add-two-numbers"])
        await peer.send({**sum_of, "message_id": "m1"})
        self.assertEqual(await peer.first(in_reply_to="m1"), {"result": 42, "in_reply_to": "m1"})
        await peer.send({"op": "call_service", "id": "c1", "service": "/mine", "args": {"data": False}})
        answer = await peer.first(op="service_response", id="c1")
        self.assertEqual((answer["result"], answer["values"]), (True, {"success": True, "message": "off"}))
        await peer.send({"plain": "é"})
        self.assertEqual(timeless(await peer.first(plain="é")), {"plain": "é"})

    async def test_is_met_again_after_it_was_away(self):
        done = asyncio.Queue()

        async def play(peer):
            await self.check(peer)
            await done.put(True)
            await peer.socket.wait_closed()

        server = await self.listening(play)
        with await asyncio.to_thread(robot, "connect", "standard", self.url) as guest:
            await in_time(done.get())
            server.close()
            await in_time(server.wait_closed())
            await self.listening(play, port=self.port)
            await in_time(done.get())
            self.assertEqual(await asyncio.to_thread(guest.end, signal.SIGTERM), 0, guest.stderr)


if __name__ == "__main__":
    unittest.main()

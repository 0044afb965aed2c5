# SPDX-License-Identifier: Apache-2.0
"""Calls and plain messages: the program against a rosbridge_server with all its oddities, and
against Hop peers of both periods with the profile for them."""
import json
import signal
import unittest

from fake_hop import hop_server, later, may_2014
from fake_rosbridge import fake_rosbridge
from program import given_time, program, run

sum_of = {"service": "add-two-numbers", "a": 38, "b": 4}
# Longer than an endpoint waits before it pings (3 s), and before it cuts who is silent (8 s).
silence = 9.5


def parsed(lines):
    return [json.loads(line) for line in lines]


class calling_ros(unittest.TestCase):
    def setUp(self):
        self.bridge = self.enterContext(fake_rosbridge())

    def call(self, *arguments):
        return run("call", self.bridge.url, *arguments)

    def calls(self):
        return [message for _, message in self.bridge.heard if message["op"] == "call_service"]

    def repeat(self, count):
        """As many calls, all of them answered."""
        ended = self.call("/add_two_ints", '{"a":1,"b":2}', "--repeat", str(count), "--json")
        self.assertEqual(ended.code, 0, ended.stderr)
        (told,) = parsed(ended.stdout)
        self.assertEqual((told["calls"], told["answered"]), (count, count))
        self.assertEqual(len({asked["id"] for asked in self.calls()}), len(self.calls()))

    def fails(self, code, *arguments, says):
        self.call(*arguments).expect(code, stdout=[], says=says)

    def test_prints_the_answer_s_values(self):
        ended = self.call("/add_two_ints", '{"a":1,"b":2}')
        self.assertEqual((ended.code, ended.stdout), (0, ['{"sum":3}']), ended.stderr)
        (asked,) = self.calls()
        self.assertEqual((asked["service"], asked["args"]), ("/add_two_ints", {"a": 1, "b": 2}))
        self.assertIn("id", asked)
        self.assertNotIn("fragment_size", asked)
        self.assertEqual(self.bridge.ignored, [])

    def test_an_error_of_the_service_is_its_sentence(self):
        self.fails(1, "/fail", says=["it always fails"])
        self.fails(1, "/nope/deeper", says=["Service /nope/deeper does not exist"])

    def test_an_error_that_is_no_sentence_is_an_error_all_the_same(self):
        for values in ({"code": 7}, None, 7, ["x"]):
            self.bridge.on_call_service = lambda sender, m, v=values: self.bridge.respond(
                sender, m["id"], m["service"], v, False)
            self.fails(1, "/odd", says=["/odd"])

    def test_a_service_that_is_silent_is_a_time_out(self):
        self.bridge.on_call_service = lambda *_: None
        ended = given_time(lambda time: self.call("/silent", "--timeout", time), lambda it: it.code != 3)
        ended.expect(4, stdout=[], last="/silent")

    def test_a_bridge_that_goes_away_ends_the_call(self):
        self.bridge.on_call_service = lambda *_: self.bridge.cut()
        ended = self.call("/add_two_ints", "--timeout", "50s")
        self.assertIn(ended.code, (1, 3), ended.stderr)
        self.assertNotEqual(ended.stderr, [])

    def test_answers_to_others_are_not_taken_for_ours(self):
        def misleads(sender, message):
            wrong = {"sum": 666}
            for identity in ("other", message["id"] + "0", message["id"][:-1], 7, None):
                self.bridge.respond(sender, identity, message["service"], wrong, True)
            sender.send({"op": "publish", "topic": "/add_two_ints", "msg": wrong})
            self.bridge.respond(sender, message["id"], message["service"], {"sum": 3}, True)
            self.bridge.respond(sender, message["id"], message["service"], wrong, True)  # once more

        self.bridge.on_call_service = misleads
        ended = self.call("/add_two_ints", '{"a":1,"b":2}')
        self.assertEqual((ended.code, ended.stdout), (0, ['{"sum":3}']), ended.stderr)
        self.repeat(20)

    def test_understands_an_answer_in_fragments(self):
        def answers(sender, message):
            for sender.fragment_size in 20, 7, 1000:
                self.bridge.respond(sender, message["id"], message["service"], {"sum": 3}, True)

        self.bridge.on_call_service = answers
        ended = self.call("/add_two_ints", '{"a":1,"b":2}')
        self.assertEqual((ended.code, ended.stdout), (0, ['{"sum":3}']), ended.stderr)


class hop_profile:
    """A Hop program of one period at the other end: it must meet nothing it does not know, to the end."""

    def setUp(self):
        self.hop = self.enterContext(hop_server(period=self.period))

    def rowe(self, verb, *arguments, hop=None):
        ended = run(verb, (hop or self.hop).url, *arguments, "--plain", "--profile", self.profile)
        self.untouched(hop or self.hop)
        return ended

    def untouched(self, hop):
        hop.wait(lambda: len(hop.ends) == len(hop.streams), "the end of every connection")
        self.assertEqual(hop.drops, [])
        self.assertEqual([one.offers for one in hop.requests], [[]] * len(hop.requests))

    def test_the_paper_s_call(self):
        ended = self.rowe("call", sum_of["service"], '{"a":38,"b":4}').expect(0)
        self.assertEqual([answer["result"] for answer in parsed(ended.stdout)], [42])
        self.assertEqual(self.rowe("call", sum_of["service"], '{"a":38,"b":4}', "--repeat", "20").code, 0)
        asked = parsed(self.hop.heard)
        self.assertEqual(len({one.pop("message_id") for one in asked}), 21)
        self.assertEqual(asked, [sum_of] * 21)

    def test_a_call_that_no_program_answers_is_a_time_out(self):
        ended = given_time(lambda time: self.rowe("call", "no-such-service", "--timeout", time),
                           lambda it: it.code != 3)
        self.assertEqual(ended.code, 4, ended.stderr)

    def test_unrelated_messages_between_call_and_answer(self):
        def chats(text):
            identity = json.loads(text)["message_id"]
            self.chatty.send(json.dumps({"status": "busy"}))
            for other in (identity + "0", identity[:-1], 7, None):
                self.chatty.send(json.dumps({"result": 666, "in_reply_to": other}))
            self.chatty.send(json.dumps({"in_reply_to": identity, "result": 42}))
            return json.dumps({"in_reply_to": identity, "result": 666})

        self.chatty = self.enterContext(hop_server(period=self.period, program=chats))
        ended = self.rowe("call", sum_of["service"], hop=self.chatty)
        self.assertEqual([answer["result"] for answer in parsed(ended.stdout)], [42], ended.stderr)

    def test_plain_messages_go_as_they_are(self):
        quiet = self.enterContext(hop_server(period=self.period, program=lambda _: None))
        texts = ['{"x":1.5}', '{"name":"é/😀"}', json.dumps({"x": "x" * 1000})]
        for text in texts:
            self.assertEqual(self.rowe("pub", text, "--once", hop=quiet).code, 0)
        self.assertEqual(parsed(quiet.heard), parsed(texts))

    def test_plain_messages_are_printed(self):
        texts = ['{"x":1.5}', json.dumps({"x": "x" * 200}), json.dumps({"x": "x" * 3000})]
        with program("echo", self.hop.url, "--plain", "--profile", self.profile, "--json") as echo:
            while not echo.stdout and echo.process.poll() is None:  # sent into the void until it listens
                self.hop.send('{"probe":1}')
                with echo.changed:
                    echo.changed.wait(0.05)
            for text in texts:
                self.hop.send(text)
            echo.line("x{3000}", "stdout")
            self.assertEqual(echo.end(signal.SIGINT), 0, echo.stderr)
            self.assertEqual([one for one in parsed(echo.stdout) if "probe" not in one], parsed(texts))
        self.untouched(self.hop)

    def test_a_message_that_hop_could_not_read_is_not_sent(self):
        ended = self.rowe("pub", json.dumps({"x": "x" * 65536}), "--once")
        self.assertNotIn(ended.code, (0, 130), ended.stderr)
        self.assertNotEqual(ended.stderr, [])
        self.assertEqual(self.hop.heard, [])

    def test_another_path_is_named(self):
        given_time(lambda time: run("call", f"ws://127.0.0.1:{self.hop.port}/robot", "x", "--plain",
                                    "--profile", self.profile, "--timeout", time),
                   lambda it: "404" in "\n".join(it.stderr)).expect(3, says="404")

    def test_silence_is_neither_pinged_nor_cut(self):
        with program("echo", self.hop.url, "--plain", "--profile", self.profile, "--json") as echo:
            self.hop.wait(lambda: self.hop.upgraded, "the connection")
            with self.assertRaises(AssertionError):
                self.hop.wait(lambda: self.hop.ends, "an end", seconds=silence)
            self.hop.send('{"still":"here"}')
            echo.lines(1)
            self.assertEqual(echo.end(signal.SIGINT), 0)
        self.untouched(self.hop)


class calling_later_hop(hop_profile, unittest.TestCase):
    profile, period = "hop", later


class calling_hop_of_may_2014(hop_profile, unittest.TestCase):
    profile, period = "hop_2014", may_2014


if __name__ == "__main__":
    unittest.main()

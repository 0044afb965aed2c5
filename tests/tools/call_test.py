# SPDX-License-Identifier: Apache-2.0
"""`rowe call` and `rowe peers`: services of the hub, of its peers and of the demo robot, over rosbridge and
in the plain format; and every way a call can fail."""
import contextlib
import json
import re
import signal
import threading
import unittest

from program import given_time, hub, program, run
from websocket import CLOSE, closed, listener, peer, settle


class provider:
    """A rosbridge client that provides services, each a function from a call's arguments to its answer: the
    members beside op, service and id, or nothing for none."""

    def __init__(self, port, **services):
        self.peer = peer(port)
        self.services = {f"/{name}": answer for name, answer in services.items()}
        for name in self.services:
            self.peer.send({"op": "advertise_service", "service": name, "type": "x/X"})
        settle(self.peer)
        self.thread = threading.Thread(target=self.serve, daemon=True)
        self.thread.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        with contextlib.suppress(OSError):
            self.peer.send_frame(CLOSE)
        self.thread.join()
        self.peer.stream.close()

    def serve(self):
        with contextlib.suppress(closed, OSError):
            while True:
                call = self.peer.called()
                answer = self.services[call["service"]](call.get("args", {}))
                if answer is not None:
                    self.peer.send({"op": "service_response", "service": call["service"], "id": call["id"],
                                    "result": True, **answer})


def add(asked):
    return {"values": {"sum": asked["a"] + asked["b"]}}


def refuse(_):
    return {"values": "not today", "result": False}


def silent(_):
    return None


class calling(unittest.TestCase):
    def fails(self, code, *arguments, says, **options):
        run("call", *arguments, code=code, stdout=[], says=says, **options)


class services_of_peers(calling):
    def setUp(self):
        self.serving = self.enterContext(hub())
        self.there = self.enterContext(
            provider(self.serving.port, add=add, refuse=refuse, silent=silent,
                     long=lambda asked: {"values": {"text": "x" * asked["length"]}}))

    def test_keep_whole_numbers_to_the_last_digit(self):
        run("call", self.serving.url, "/add", '{"a":9223372036854775806,"b":1}',
            stdout=['{"sum": 9223372036854775807}'])

    def test_are_reached_through_the_hub_by_either_codec(self):
        for name in ("/add", "add"):
            for how in ((), ("--plain",)):
                ended = run("call", self.serving.url, name, '{"a":38,"b":4}', *how)
                self.assertEqual((ended.code, ended.stderr, len(ended.stdout)), (0, [], 1), (name, how))
                self.assertEqual(json.loads(ended.stdout[0]), {"sum": 42}, (name, how))

    def test_may_say_no(self):
        for how in ((), ("--plain",)):
            self.fails(1, self.serving.url, "/refuse", *how, says=["service /refuse: not today"])

    def test_that_nobody_provides_are_named(self):
        for how in ((), ("--plain",)):
            self.fails(1, self.serving.url, "/nope", *how, says=["service /nope: nobody provides it"])

    def test_that_are_misspelt_name_the_one_that_was_meant(self):
        self.fails(1, self.serving.url, "/ad", says=["nobody provides it", "; did you mean /add?"])

    def test_answers_are_shown_in_part_and_as_a_table(self):
        asking = ("call", self.serving.url, "/add", '{"a":1,"b":2}')
        run(*asking, "--field", "sum", code=0, stdout=["3"])
        run(*asking, "--csv", code=0, stdout=["sum", "3"])
        run(*asking, "--pretty", code=0, prints="sum")
        run(*asking, "--field", "nothing", code=1, stdout=[], says="the answer has no 'nothing'")
        for wrong in (("--json", "--csv"), ("--json", "--field", "sum"), ("--repeat", "2", "--pretty")):
            run(*asking, *wrong, code=2)

    def test_that_do_not_answer_are_a_time_out(self):
        for how in ((), ("--plain",)):
            ended = given_time(lambda time: run("call", self.serving.url, "/silent", "--timeout", time, *how),
                               lambda ended: ended.code != 3).expect(4, stdout=[])
            self.assertRegex(ended.stderr[-1], r"service /silent: no answer within \d+\.\d{3} s")

    def test_whose_provider_goes_away_are_no_time_out(self):
        for how in ((), ("--plain",)):
            with provider(self.serving.port, leaving=lambda _: leaves.peer.stream.shutdown(2)) as leaves:
                ended = run("call", self.serving.url, "/leaving", "--timeout", "50s", *how, code=1, stdout=[],
                            last="service /leaving: ")
                self.assertNotIn("no answer within", ended.stderr[-1])
            self.fails(1, self.serving.url, "/leaving", *how, says=["nobody provides it"])

    def test_whose_hub_goes_away_are_no_time_out_either(self):
        for how in ((), ("--plain",)):
            with hub() as serving:
                asked = threading.Event()
                with provider(serving.port, silent=lambda _: asked.set()):
                    with program("call", serving.url, "/silent", "--timeout", "50s", *how) as calling_it:
                        self.assertTrue(asked.wait(60))
                        serving.process.kill()
                        self.assertEqual(calling_it.end(), 1, calling_it.stderr)
                        self.assertIn("service /silent: the provider went away", calling_it.stderr[-1])
                serving.process.wait()

    def test_can_be_given_up(self):
        for how in ((), ("--plain",)):
            asked = threading.Event()
            with provider(self.serving.port, slow=lambda _: asked.set()):
                with program("call", self.serving.url, "/slow", "--timeout", "50s", *how) as calling_it:
                    self.assertTrue(asked.wait(60))
                    self.assertEqual(calling_it.end(signal.SIGINT), 130)
                    self.assertEqual(calling_it.stdout, [])

    def test_may_answer_at_length(self):
        for how in ((), ("--plain",)):
            ended = run("call", self.serving.url, "/long", '{"length":50000}', *how, code=0)
            self.assertEqual(json.loads(ended.stdout[0]), {"text": "x" * 50000})

    def test_answer_with_a_time_where_json_is_asked_for(self):
        members = ["service", "answer", "error", "text", "round_trip_ns"]
        for name, code, answer, error in (("/add", 0, {"sum": 3}, None), ("/refuse", 1, None, "refused"),
                                          ("/nope", 1, None, "no_service"),
                                          ("/silent", 4, None, "timed_out")):
            def ask(time):
                return run("call", self.serving.url, name, '{"a":1,"b":2}', "--json", "--timeout", time)

            ended = given_time(ask, lambda ended: ended.code != 3) if code == 4 else ask("60s")
            self.assertEqual(ended.code, code, ended.stderr)
            (line,) = ended.stdout
            told = json.loads(line)
            self.assertEqual(list(told), members)
            self.assertEqual((told["service"], told["answer"], told["error"]), (name, answer, error))
            self.assertEqual(told["text"] is None, error is None)
            self.assertGreater(told["round_trip_ns"], 0)

    def test_are_timed_over_many_calls(self):
        members = ["service", "calls", "answered", "failed", "timed_out",
                   "min_ns", "p50_ns", "p99_ns", "max_ns"]
        for how in ((), ("--plain",)):
            ended = run("call", self.serving.url, "/add", '{"a":1,"b":2}', "--repeat", "100", "--json", *how)
            self.assertEqual((ended.code, ended.stderr), (0, []))
            (line,) = ended.stdout
            told = json.loads(line)
            self.assertEqual(list(told), members)
            self.assertEqual(list(told.values())[1:5], [100, 100, 0, 0])
            times = list(told.values())[5:]
            self.assertEqual(times, sorted(times))
            self.assertGreater(times[0], 0)
        ended = run("call", self.serving.url, "/add", '{"a":1,"b":2}', "--repeat", "10")
        self.assertRegex("\n".join(ended.stdout),
                         r"^/add: 10 calls, 10 answered, 0 failed, 0 timed out; min \d+\.\d µs, p50 .*, max ")

    def test_that_fail_again_and_again_are_reported_once(self):
        ended = run("call", self.serving.url, "/refuse", "--repeat", "20", "--json")
        self.assertEqual((ended.code, len(ended.stderr)), (1, 1), ended.stderr)
        told = json.loads(ended.stdout[0])
        self.assertEqual((told["calls"], told["failed"], told["max_ns"]), (20, 20, 0))
        ended = given_time(lambda time: run("call", self.serving.url, "/silent", "--repeat", "6", "--timeout",
                                            time, "--json"),
                           lambda ended: ended.code == 4, 0.02)  # else all places for calls may be taken
        self.assertEqual(ended.code, 4, ended.stderr)
        self.assertEqual(json.loads(ended.stdout[0])["timed_out"], 6)

    def test_are_called_until_it_is_told_to_end(self):
        enough = threading.Event()
        calls = []

        def counting(_):
            calls.append(1)
            if len(calls) == 10:
                enough.set()
            return {"values": {}}

        with provider(self.serving.port, counting=counting):
            with program("call", self.serving.url, "/counting", "--repeat", "1000000000",
                         "--json") as calling_it:
                self.assertTrue(enough.wait(60))
                self.assertEqual(calling_it.end(signal.SIGINT), 0, calling_it.stderr)
                self.assertGreaterEqual(json.loads(calling_it.stdout[0])["answered"], 9)


class the_robot(calling):
    def test_drives_at_the_speed_that_is_set(self):
        with hub("--demo") as robot:
            for how in ((), ("--plain",)):
                ended = run("call", robot.url, "/robot/set_speed", '{"speed":0.5}', *how)
                self.assertEqual((ended.code, ended.stdout), (0, ['{"speed":0.5}']), ended.stderr)
                self.fails(1, robot.url, "/robot/set_speed", '{"speed":1.5}', *how,
                           says=["service /robot/set_speed: the speed is out of range: 0 to 1 m/s"])
                self.fails(1, robot.url, "/robot/set_speed", '{"speed":"fast"}', *how,
                           says=["/robot/set_speed: "])
                self.fails(1, robot.url, "/robot/set_speed", *how, says=["/robot/set_speed: "])
            self.assertEqual(run("call", robot.url, "/robot/set_speed", '{"speed":0}').code, 0)
            with program("echo", robot.url, "/odom", "--json", "--field", "twist.twist.linear.x") as echo:
                count = 1
                while abs(float(echo.lines(count)[count - 1])) > 1e-3:
                    count += 100  # some of the thousand a second
                # 6, and it says so: on a busy machine it lost some.
                code = echo.end(signal.SIGINT)
                self.assertTrue(code == 0 or (code == 6 and echo.stderr), (code, echo.stderr))


class arguments(calling):
    def test_that_make_no_sense_are_named(self):
        asked = run("param", "ws://127.0.0.1:1")
        self.assertIn("the argument list|get|set is missing before 'ws://127.0.0.1:1'", asked.stderr[0])
        for words, says in (((), "the argument URL is missing"),
                            (("ws://127.0.0.1:1",), "the argument SERVICE is missing"),
                            (("ws://127.0.0.1:1", "/x", "{", "more"), "one argument too many: 'more'"),
                            (("ws://127.0.0.1:1", "/x", "{"),
                             "'{' is no JSON object: it ends too early (at byte 1)"),
                            (("ws://127.0.0.1:1", "/x", "7"), "it does not begin with {"),
                            (("ws://127.0.0.1:1", "/x", "--repeat", "0"),
                             "--repeat 0 is out of range: 1 to "),
                            (("ws://127.0.0.1:1", "/x", "--timeout", "0"), "0 is out of range: 1ns"),
                            (("ws://127.0.0.1:1", "/x", "--profile", "hip"), "standard or hop or hop_2014"),
                            (("ws://127.0.0.1:1", "/x", '{"service":"y"}', "--plain"), "`service`"),
                            (("ws://127.0.0.1:1", "x" * 200), "cannot call 'xxx"),
                            (("ws://127.0.0.1:1", "/x", '{"a":"' + "x" * 62000 + '"}'),
                             "62008 bytes, at most 61440"),
                            (("/odom", "/x"), "ws[s]://HOST[:PORT][/PATH]")):
            self.fails(2, *words, says=[says])

    def test_members_that_rowe_needs_itself_are_refused(self):
        with hub() as serving:
            for member in ("op", "message_id", "in_reply_to"):
                self.fails(2, serving.url, "/x", json.dumps({member: "y"}), "--plain", says=[member])


class peers(unittest.TestCase):
    def test_are_listed_for_people(self):
        with hub("--name", "ang-01") as serving, peer(serving.port) as one:
            one.subscribe("/t")
            ended = run("peers", serving.url, code=0, stderr=[])
            self.assertRegex(ended.stdout[0], r"^ang-01, up for \d+\.\d+ s, peers 2$")
            self.assertEqual(ended.stdout[1].split(),
                             ["ADDRESS", "DIALECT", "SINCE_S", "SILENT_S", "QUEUED", "IN", "OUT"])
            rows = [line.split() for line in ended.stdout[2:4]]
            self.assertEqual([len(row) for row in rows], [7, 7])
            local = f"127.0.0.1:{one.stream.getsockname()[1]}"
            (row,) = [row for row in rows if row[0] == local]
            self.assertEqual((row[1], row[5], row[6]), ("rosbridge", "2", "1"))
            self.assertRegex(ended.stdout[4], r"^losses: (none|\w+ [1-9]\d*)")
            self.assertEqual(len(ended.stdout), 5)

    def test_are_listed_for_programs(self):
        with hub() as serving, peer(serving.port), peer(serving.port):
            ended = run("peers", serving.url, "--json")
            self.assertEqual((ended.code, ended.stderr, len(ended.stdout)), (0, [], 1))
            told = json.loads(ended.stdout[0])
            self.assertLessEqual({"name", "uptime_s", "peers", "topics", "losses", "connections", "counters",
                                  "limits"}, set(told))
            self.assertEqual((told["peers"], len(told["connections"])), (3, 3))
            for one in told["connections"]:
                self.assertLessEqual({"address", "dialect", "since_s", "silent_s", "queued", "messages_in",
                                      "messages_out"}, set(one))
                self.assertRegex(one["address"], r"^127\.0\.0\.1:\d+$")
            self.assertEqual(told["limits"]["connections_max"], 40)

    def test_of_who_is_no_rowe_endpoint_cannot_be_had(self):
        for values, result in (("Service /rowe/stats does not exist", False), ("no", False)):
            with listener() as there, program("peers", there.url) as asking, there.accept() as p:
                call = p.called()
                self.assertEqual(call["service"], "/rowe/stats")
                p.answer(call, values, result)
                asking.end()
                asking.expect(1, stdout=[], last="does not let us call /rowe/stats")

    def test_of_who_does_not_answer_are_a_time_out(self):
        def ask(time):
            with listener() as there, program("peers", there.url, "--timeout", time) as asking:
                with there.accept():
                    asking.code = asking.end()
            return asking

        asking = given_time(ask, lambda asking: asking.code != 3)
        asking.expect(4, stdout=[], ends=r"does not answer within \d+\.\d{3} s")

    def test_of_a_stranger_do_not_reach_the_terminal_as_control_characters(self):
        with listener() as there, program("peers", there.url) as asking, there.accept() as p:
            p.answer(p.called(), {"name": "\x1b[2J", "connections": [{"address": "\x9b"}, 7],
                                  "losses": {"\x1b": 1}})
            self.assertEqual(asking.end(), 0, asking.stderr)
            self.assertIsNone(re.search("[\x1b\x9b]", "\n".join(asking.stdout)))


if __name__ == "__main__":
    unittest.main()

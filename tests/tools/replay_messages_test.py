# SPDX-License-Identifier: Apache-2.0
"""`rowe replay` of recordings and of lines: what a server gets, in which order and not before its time."""
import contextlib
import json
import os
import signal
import socket
import struct
import subprocess
import tempfile
import threading
import time
import unittest

from program import hub, kept_port, nobody_at, on_a_terminal, program, run, timeout
from recordings import (beside, damage, end_of_chunk, magic, message, record, samples, write_ros,
                        write_with_attachment)
from websocket import closed, listener


class taken:
    """What a server gets of one connection: messages (topic, body), and when."""

    def __init__(self):
        self.there = listener()
        self.url = self.there.url
        self.asked, self.messages, self.times, self.failure = [], [], [], None
        self.changed = threading.Condition()
        self.thread = threading.Thread(target=self.take, daemon=True)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        with contextlib.suppress(OSError):
            self.there.socket.shutdown(socket.SHUT_RDWR)  # ends accept()
        self.there.socket.close()
        self.thread.join(timeout)

    def take(self):
        try:
            with self.there.accept() as p:
                while True:
                    one = p.receive()
                    with self.changed:
                        if one.get("op") == "publish":
                            self.messages.append((one["topic"], one["msg"]))
                            self.times.append(time.monotonic())
                        else:
                            self.asked.append(one)
                        self.changed.notify_all()
        except (closed, OSError):
            pass

    def wait(self, count):
        end = time.monotonic() + timeout
        with self.changed:
            while len(self.messages) < count:
                assert self.changed.wait(end - time.monotonic()), self.messages

    def all(self):
        """When the connection has ended."""
        self.thread.join(timeout)
        assert not self.thread.is_alive()
        return self.messages

    def types(self):
        return {one["topic"]: one.get("type") for one in self.asked if one["op"] == "advertise"}


class replaying(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory())
        self.path = os.path.join(self.folder, "run.mcap")

    def play(self, *arguments, path=None, **wanted):
        """What a server gets of a replay, and its end."""
        with taken() as server:
            ended = run("replay", server.url, path or self.path, *arguments, **{"code": 0, **wanted})
            return server.all(), ended, server

    def numbers(self, *arguments, **wanted):
        return [body["n"] for _, body in self.play(*arguments, **wanted)[0]]


class order_and_times(replaying):
    def test_messages_come_in_their_order_across_topics(self):
        wanted = []
        for i in range(600):  # all topics at once, again and again
            wanted.append((f"/topic/{i * 7 % 11}", {"n": i}))
        record(self.path, [message(topic, i // 40, body) for i, (topic, body) in enumerate(wanted)], "lz4")
        got, ended, _ = self.play()
        self.assertEqual(got, wanted)
        self.assertRegex(ended.stderr[-1], r"published 600 messages in \d+\.\d{3} s; "
                                           r"late p50 \d+\.\d\d ms, p99 \d+\.\d\d ms, max \d+\.\d\d ms$")

    def test_messages_come_in_the_order_of_their_times(self):
        record(self.path, [message("/a", t, {"n": t}) for t in (3, 1)] + [end_of_chunk] +
               [message("/b", t, {"n": t}) for t in (2, 0, 4)])
        self.assertEqual(self.numbers(), [0, 1, 2, 3, 4])

    def test_topics_have_their_types(self):
        record(self.path, [message("/odom", 0, {}, type="nav_msgs/Odometry"), message("/x", 0, {})])
        _, _, server = self.play()
        self.assertEqual(server.types()["/odom"], "nav_msgs/Odometry")
        self.assertIn("/x", server.types())

    def check_times(self, factor, *arguments):
        with contextlib.suppress(FileNotFoundError):
            os.remove(self.path)
        record(self.path, [message("/a" if i % 2 else "/b", 30 * i, {"n": i}) for i in range(11)])
        with taken() as server:
            begin = time.monotonic()
            run("replay", server.url, self.path, *arguments, code=0)
            server.all()
            for i, when in enumerate(server.times):
                self.assertGreaterEqual(when - begin, 0.030 * i * factor)

    def test_no_message_comes_before_its_time(self):
        self.check_times(1)

    def test_a_rate_stretches_the_times(self):
        self.check_times(2, "--rate", "0.5")
        self.check_times(0.5, "--rate", "2x")

    def test_a_thousand_messages_a_second_take_their_time(self):
        record(self.path, [message("/a", i, {"n": i}) for i in range(2000)])
        with taken() as server:
            begin = time.monotonic()
            run("replay", server.url, self.path, code=0)
            self.assertEqual(len(server.all()), 2000)
            self.assertGreaterEqual(server.times[-1] - begin, 1.999)

    def test_long_messages_keep_their_place(self):
        long = "x" * 200_000
        wanted = [("/a", {"n": 0}), ("/map", {"text": long}), ("/a", {"n": 1}),
                  ("/map", {"text": long[:9000]}), ("/b", {"n": 2})]
        record(self.path, [message(topic, 0, body) for topic, body in wanted], "zstd")
        self.assertEqual(self.play()[0], wanted)


class chosen(replaying):
    def setUp(self):
        super().setUp()
        record(self.path, [message("/a", 10 * i, {"n": i}) for i in range(10)])

    def test_from_and_to_are_offsets_or_times(self):
        for arguments, wanted in ((("--from", "40ms"), range(4, 10)), (("--to", "40ms"), range(0, 4)),
                                  (("--from", "-20ms"), range(7, 10)), (("--to", "-20ms"), range(0, 7)),
                                  (("--from", "2025-11-30T04:09:58.05Z", "--to", "0:00.080"), range(5, 8)),
                                  (("--from", "0", "--to", "10m"), range(0, 10)),
                                  (("--from", "-10m"), range(0, 10))):
            self.assertEqual(self.numbers(*arguments), list(wanted), arguments)

    def test_from_and_to_that_make_no_sense_are_told_with_what_the_recording_spans(self):
        for arguments, says in ((("--from", "1s"), "--from 1s is behind its end: the recording is from 2025"),
                                (("--from", "50ms", "--to", "50ms"), "--to 50ms is not behind --from 50ms"),
                                (("--from", "soon"), "--from needs a time such as 90s"),
                                (("--to", "5"), "--to needs a time such as 90s")):
            run("replay", "127.0.0.1:1", self.path, *arguments, code=2, says=says)

    def test_laps_go_on_until_it_is_interrupted(self):
        with taken() as server:
            begin = time.monotonic()
            with program("replay", server.url, self.path, "--loop", "--from", "50ms") as looping:
                server.wait(18)
                self.assertEqual(looping.end(signal.SIGINT), 0)
                looping.line(r"published \d+ messages in \d+\.\d+ s and \d+ whole laps?; late")
            got = [body["n"] for _, body in server.all()]
        self.assertEqual(got, [5 + i % 5 for i in range(len(got))])
        for i, when in enumerate(server.times):  # a step of mean length lies between two laps
            self.assertGreaterEqual(when - begin, 0.010 * i)

    def test_what_is_interrupted_exits_with_130(self):
        path = os.path.join(self.folder, "slow.mcap")
        record(path, [message("/a", 0, {"n": 0}), message("/a", 600_000, {"n": 1})])
        with taken() as server, program("replay", server.url, path) as playing:
            server.wait(1)
            self.assertEqual(playing.end(signal.SIGTERM), 130)
            playing.line("published 1 message in")

    def test_a_single_message_cannot_loop(self):
        path = os.path.join(self.folder, "single.mcap")
        record(path, [message("/a", 0, {})])
        run("replay", "127.0.0.1:1", path, "--loop", code=2, first="no duration")


class topics(replaying):
    def setUp(self):
        super().setUp()
        names = ("/odom", "/arm/left", "/arm/left/pose", "/arm/right/pose", "/rowe/stop/state")
        record(self.path, [message(name, 0, {"of": name}) for name in names])

    def names(self, *arguments, **wanted):
        return sorted(topic for topic, _ in self.play(*arguments, **wanted)[0])

    def test_patterns_choose_and_exclude(self):
        arms = ["/arm/left", "/arm/left/pose", "/arm/right/pose"]
        for arguments, wanted in ((("--topics", "/odom"), ["/odom"]), (("--topics", "/arm/*"), ["/arm/left"]),
                                  (("--topics", "/arm/**"), arms), (("--exclude", "/arm/**"), ["/odom"]),
                                  (("--topics", "odom,/arm/*/pose", "--exclude", "/arm/r**"),
                                   ["/arm/left/pose", "/odom"]),
                                  (("--topics", "/odom", "--topics", "/arm/left"), ["/arm/left", "/odom"])):
            self.assertEqual(self.names(*arguments), wanted, arguments)

    def test_the_endpoint_s_own_topics_are_named_and_counted(self):
        _, ended, _ = self.play()
        ended.expect(0, says="not played, since the endpoint has its own (--remap gives other names): "
                             "/rowe/stop/state (1 message)")

    def test_topics_get_other_names(self):
        got, ended, server = self.play("--remap", "/odom:=/recorded/odom", "--remap", "arm/left=/other",
                                       "--remap", "/rowe/stop/state:=/recorded/stop",
                                       "--topics", "/odom,/arm/left,/rowe/**")
        self.assertEqual(got, [("/recorded/odom", {"of": "/odom"}), ("/other", {"of": "/arm/left"}),
                               ("/recorded/stop", {"of": "/rowe/stop/state"})])
        self.assertNotIn("/odom", server.types())
        self.assertNotIn("not played", "\n".join(ended.stderr))

    def test_several_topics_can_become_one(self):
        got, _, _ = self.play("--remap", "/arm/left/pose:=/arm/right/pose", "--topics", "/arm/*/pose")
        self.assertEqual([topic for topic, _ in got], ["/arm/right/pose"] * 2)

    def test_wishes_that_meet_nothing_are_refused(self):
        for arguments, says in ((("--topics", "/odm"), "--topics '/odm': the recording has no such topic"),
                                (("--exclude", "/odm"), "--exclude '/odm': the recording has no such topic"),
                                (("--remap", "/odm:=/x"), "--remap '/odm': the recording has no such topic"),
                                (("--remap", "/odom"), "--remap needs FROM:=TO"),
                                (("--remap", ":=/x"), "--remap needs FROM:=TO"),
                                (("--remap", "/odom:=/rowe/x"), "topics below /rowe/ are the endpoint's own"),
                                (("--topic", "/x"), "--topics chooses"), (("--rate", "10Hz"), "a factor"),
                                (("--rate", "0x"), "'0x'"), (("--rate", "2000x"), "0.001x to 1000x")):
            run("replay", "127.0.0.1:1", self.path, *arguments, code=2, says=says)
        run("replay", "127.0.0.1:1", self.path, "--topics", "/rowe/**", code=1, says="nothing to play")


class odd_files(replaying):
    def test_a_damaged_part_is_named_and_playing_goes_on(self):
        record(self.path, [message("/a", 0, {"n": 0}), end_of_chunk, message("/a", 1, {"n": "damaged"}),
                           end_of_chunk, message("/a", 2, {"n": 2})])
        damage(self.path, b'"damaged"')
        got, ended, _ = self.play(code=1)
        self.assertEqual([body["n"] for _, body in got], [0, 2])
        ended.expect(1, says=("damaged at byte ", ), ends="published 2 messages .*, 1 part could not be read")

    def test_a_file_that_was_cut_off_is_played_as_far_as_it_goes(self):
        record(self.path, [message("/a", i, {"n": i}) for i in range(20)], "lz4", cut=True)
        self.assertEqual(self.numbers(), list(range(20)))

    def test_messages_of_ros_are_played_as_json(self):
        text = "float64 x\nuint8[] bytes\n"
        body = struct.pack("<d", 0.5), struct.pack("<I2s", 2, b"ab")
        write_ros(self.path, {"/ros1": ("ros1", "ros1msg", "a/T", text, b"".join(body)),
                              "/ros2": ("cdr", "ros2msg", "a/msg/T", text, b"\0\1\0\0" + b"".join(body)),
                              "/broken": ("cdr", "ros2msg", "a/msg/T", "nonsense", b""),
                              "/short": ("ros1", "ros1msg", "a/T", text, body[0])})
        got, ended, _ = self.play(code=None)
        self.assertEqual(sorted(got), [("/ros1", {"x": 0.5, "bytes": "YWI="}),
                                       ("/ros2", {"x": 0.5, "bytes": "YWI="})])
        ended.expect(says=("in the encoding 'cdr', which cannot be decoded: /broken (1 message)", "/short"))

    def test_other_encodings_are_named_and_counted(self):
        samples(self.folder)
        got, ended, _ = self.play(path=os.path.join(self.folder, "many.zstd.mcap"), code=6)
        self.assertEqual({topic for topic, _ in got}, {"/a", "/b"})
        ended.expect(says="not played, in an encoding that is not said: /no/schema (50 messages)",
                     ends=r"skipped 50: /größe 50 no JSON object")  # it says that it is of ROS 2, and is not
        run("replay", "127.0.0.1:1", os.path.join(self.folder, "many.mcap"), "--topics", "/no/schema", code=1,
            says="nothing to play")

    def test_what_is_no_recording_is_told(self):
        for name, content, says in (("none", None, "No such file"), ("empty", b"", "no pose"),
                                    ("text", b"1 2\n", "text:1: ")):
            path = os.path.join(self.folder, name)
            if content is not None:
                with open(path, "wb") as file:
                    file.write(content)
            run("replay", "127.0.0.1:1", path, "--topic", "/t", code=1, says=says)
        run("replay", "127.0.0.1:1", self.folder, code=1, says="directory")
        with open(self.path, "wb") as file:
            file.write(magic)
        run("replay", "127.0.0.1:1", self.path, code=1, says=self.path)

    def test_messages_that_are_too_long_are_named_and_counted(self):
        record(self.path, [message("/map", 0, {"text": "x" * 100_000}),
                           message("/map", 1, {"text": "y" * 100_000}), message("/a", 2, {"n": 2})])
        smaller = {"ROWE_LIMITS_LONG_MESSAGE_BYTES_MAX": "70000"}
        got, ended, _ = self.play(code=6, environment=smaller)
        self.assertEqual(got, [("/a", {"n": 2})])
        ended.expect(6, says="skipped: /map: its message of 100012 bytes is longer than the 70000 that can",
                     ends="published 1 message .*, skipped 2: /map 2 too long")

    def test_a_server_that_takes_less_is_named(self):
        record(self.path, [message("/map", 0, {"text": "x" * 100_000}), message("/a", 1, {"n": 1})])
        with hub("--limit", "long_message_bytes_max=65536") as serving:
            with program("replay", serving.url, self.path, "--loop") as playing:
                playing.line(r"exceeds the limit long_message_bytes_max of 65536")
                playing.line(r"skipped: /map: its message of 100012 bytes is longer than the \d+ that the")
                self.assertEqual(playing.end(signal.SIGINT), 1)
                playing.line(r"skipped \d+: /map \d+ too long; late .*; the server reported errors")

    def test_messages_that_are_no_objects_are_named_and_counted(self):
        record(self.path, [message("/a", 0, [1]), message("/a", 1, "text"), message("/a", 2, {"n": 2})])
        got, ended, _ = self.play(code=6)
        self.assertEqual(got, [("/a", {"n": 2})])
        ended.expect(6, says="skipped: /a: its message is no JSON object",
                     ends="skipped 2: /a 2 no JSON object")

    def test_what_others_wrote_is_played(self):
        write_with_attachment(self.path)
        self.assertEqual(self.play()[0], [("/a", {})])


class lines(replaying):
    def write(self, *some):
        with open(self.path, "w", encoding="utf-8") as file:
            file.writelines((one if isinstance(one, str) else json.dumps(one)) + "\n" for one in some)

    def test_lines_with_times_are_played_in_the_order_of_these(self):
        self.write({"topic": "/b", "msg": {"n": 2}, "time": 1764475798.02},
                   {"time": "2025-11-30T04:09:58Z", "topic": "/a", "msg": {"n": 0}}, "",
                   {"topic": "/a", "msg": {"n": 1}, "time": 1764475798.01})
        with taken() as server:
            begin = time.monotonic()
            run("replay", server.url, self.path, code=0)
            self.assertEqual(server.all(), [("/a", {"n": 0}), ("/a", {"n": 1}), ("/b", {"n": 2})])
            self.assertGreaterEqual(server.times[-1] - begin, 0.0199)

    def test_lines_without_times_need_a_rate(self):
        self.write(*({"topic": f"/{i % 2}", "msg": {"n": i}} for i in range(10)))
        run("replay", "127.0.0.1:1", self.path, code=1, says="give a --rate, such as 10Hz")
        self.assertEqual(self.numbers("--rate", "100Hz"), list(range(10)))
        self.assertEqual(self.numbers("--rate", "1kHz", "--from", "5ms"), list(range(5, 10)))

    def test_lines_that_are_bodies_get_the_topic(self):
        self.write({"n": 0}, {"n": 1})
        got = self.play("--topic", "/t", "--rate", "1kHz")[0]
        self.assertEqual(got, [("/t", {"n": 0}), ("/t", {"n": 1})])

    def test_lines_that_are_none_are_named_and_the_rest_is_played(self):
        self.write({"topic": "/a", "msg": {"n": 0}}, "{", {"topic": "/a"}, {"topic": "/a", "msg": {"n": 1}},
                   '{"topic":"/a","msg":{"n"')
        got, ended, _ = self.play("--rate", "1kHz", code=1)
        self.assertEqual([body["n"] for _, body in got], [0, 1])
        ended.expect(1, says=("line 2 is no JSON object", 'line 3 is not {"topic":NAME,"msg":BODY}',
                              "line 5 "),
                     ends="3 parts could not be read")
        self.write({"topic": "/a", "msg": {}, "time": 1}, {"topic": "/a", "msg": {}})
        run("replay", "127.0.0.1:1", self.path, code=1, says='1 of 2 lines have no "time"')
        self.write({"topic": "/a", "msg": {}, "time": "soon"})
        run("replay", "127.0.0.1:1", self.path, code=1, says='line 1 has a "time" that is neither')

    def test_what_echo_printed_can_be_played(self):
        with hub() as serving, program("echo", serving.url, "/a", "/b", "--json", "-n", "2") as echo:
            for topic in "/a", "/b":
                run("pub", serving.url, topic, '{"n":1}', "-w", code=0)
            self.assertEqual(echo.end(), 0)
        self.write(*echo.stdout)
        self.assertEqual(sorted(self.play("--rate", "1kHz")[0]), [("/a", {"n": 1}), ("/b", {"n": 1})])


class connection(replaying):
    def setUp(self):
        super().setUp()
        record(self.path, [message("/a", 10 * i, {"n": i}) for i in range(10)])

    def test_waits_for_a_server_that_comes_later(self):
        port = self.enterContext(kept_port())
        with program("replay", f"127.0.0.1:{port}", self.path) as playing:
            playing.line(r"waiting for ws://127\.0\.0\.1:\d+ \(Ctrl-C to stop\)")
            with hub(port=port):
                self.assertEqual(playing.end(), 0)
                playing.line("published 10 messages")

    def test_goes_on_when_the_server_comes_back(self):
        with hub(port=self.enterContext(kept_port())) as first:
            playing = self.enterContext(program("replay", first.url, self.path, "--loop"))
            with program("echo", first.url, "/a", "-n", "5") as echo:
                self.assertEqual(echo.end(), 0)
            first.end(signal.SIGKILL)
        with hub(port=first.port) as second, program("echo", second.url, "/a", "-n", "5") as echo:
            self.assertEqual(echo.end(), 0)
        self.assertIn(playing.end(signal.SIGINT), (0, 6))

    def test_gives_up_within_its_timeout(self):
        nobody_at("replay", "127.0.0.1:1", self.path).expect(3)

    def test_says_nothing_where_it_is_to_be_quiet(self):
        _, ended, _ = self.play("--quiet")
        self.assertEqual(ended.stderr, [])

    def test_a_full_disk_for_its_words_is_a_failure_and_a_closed_pipe_is_none(self):
        for words, code in (("2>/dev/full", 1), ("2>&1 | true", None)):
            with taken() as server:
                done = subprocess.run(["bash", "-c", f'"$@" {words}', "sh", beside("rowe"), "replay",
                                       server.url, self.path], timeout=timeout, check=False)
                self.assertEqual(len(server.all()), 10)
            self.assertEqual(done.returncode, code or 0)

    def test_a_narrow_terminal_shows_where_it_is(self):
        with taken() as server:
            shown = on_a_terminal(40, "replay", server.url, self.path, "--rate", "0.2")
            self.assertEqual(len(server.all()), 10)
        status = [part.split("\x1b[K")[-1] for part in shown.split("\r") if "\x1b[K" in part]
        self.assertTrue(any("0:00.0 / 0:00.0  x0.20" in one for one in status), shown)
        for one in status[:-1]:
            self.assertLess(len(one.split("\n")[0]), 40, shown)


if __name__ == "__main__":
    unittest.main()

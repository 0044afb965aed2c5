# SPDX-License-Identifier: Apache-2.0
"""What the program says to arguments, right and wrong."""
import json
import tempfile
import unittest

from program import run, verbs

bench_modes = ("rpc", "send", "stop", "loop", "expiry", "idle", "peer")


class arguments(unittest.TestCase):
    def refused(self, *arguments, says, code=2, **options):
        run(*arguments, code=code, stdout=[], says=says, **options)

    def test_usage_errors_name_the_value_and_the_limit(self):
        self.refused("serve", "--port", "70000", says=["--port is out of range: 70000 (0 to 65535)"])
        self.refused("serve", "--port", "http",
                     says=["--port needs a whole number, not \"http\" (0 to 65535)"])
        self.refused("serve", "--priority", "100", says=["--priority is out of range: 100 (0 to 99)"])
        self.refused("serve", "--cpu", "100000", says=["--cpu is out of range: 100000 (-1 to 4095)"])
        self.refused("serve", "--idle", "sleep",
                     says=["--idle needs poll, spin, wake or phase, not \"sleep\""])
        self.refused("serve", "--listen", "8080", says=["'8080'", "ADDR:PORT"])
        self.refused("serve", "--listen", "127.0.0.1:70000", says=["70000", "0 to 65535"])
        self.refused("serve", "--port", "0", "--listen", "127.0.0.1:0", says=["exclude"])
        self.refused("serve", "now", says=["'now'"])
        self.refused("replay", "ws://127.0.0.1:1", says=["the argument FILE is missing"])
        self.refused("replay", "ws://127.0.0.1:1", "--tum", "x", says=["--topic NAME is missing"])
        self.refused("replay", "ws://127.0.0.1:1", "--tum", "x", "--topic", "/t", "--rate", "1MHz", says=["'1MHz'"])
        self.refused("replay", "ws://127.0.0.1:1", "--tum", "x", "--topic", "/t", "--rate", "200kHz",
                     says=["200kHz", "at most 100000 Hz"])
        self.refused("echo", "ws://127.0.0.1:1", "/t", "-n", "0", says=["-n 0", "out of range: 1 to "])
        self.refused("echo", "ws://127.0.0.1:1", "/t", "--timeout", "5", says=["'5'", "50ms"])
        for beyond in ("0s", "0.1ns", "9999999h"):
            self.refused("echo", "ws://127.0.0.1:1", "/t", "--timeout", beyond, says=[beyond, "1ns to 2562047h"])
        self.refused("echo", "ws://127.0.0.1:1", "/t", "--once", "-n", "2", says=["exclude"])
        self.refused("pub", "ws://127.0.0.1:1", says=["TOPIC is missing"])
        self.refused("pub", "ws://127.0.0.1:1", "/t", says=["JSON|@FILE|- is missing"])
        self.refused("pub", "ws://127.0.0.1:1", "/t", '{"a":01}', says=["'{\"a\":01}'", "at byte 6"])
        self.refused("pub", "ws://127.0.0.1:1", "--plain", '{"a":"' + "x" * 62000 + '"}',
                     says=["62008 bytes, at most 61440 can be sent as a plain message"])
        self.refused("pub", "ws://127.0.0.1:1", "/t", '{"a":"' + "x" * 70000 + '"}',
                     environment={"ROWE_LIMITS_LONG_MESSAGE_BYTES_MAX": "65536"},
                     says=["70008 bytes, at most 65536", "ROWE_LIMITS_LONG_MESSAGE_BYTES_MAX raises that"])
        self.refused("pub", "ws://127.0.0.1:1", "/t", "@/nowhere/map.json",
                     says=["'/nowhere/map.json'", "No such file"])
        self.refused("pub", "ws://127.0.0.1:1", "/t", "{}", "-r", "1MHz", says=["'1MHz'"])
        self.refused("pub", "ws://127.0.0.1:1", "/t", "{}", "--once", "-n", "2", says=["exclude"])
        self.refused("pub", "ws://127.0.0.1:1", "/t", "{}", "--once", "-r", "2", says=["exclude"])
        self.refused("pub", "ws://127.0.0.1:1", "/t", '{"header":1}', "--stamp", says=["`header`"])
        self.refused("pub", "ws://127.0.0.1:1", "/t", "{}", "--ttl", "1us", says=["/t", "out of range"])
        self.refused("pub", "ws://127.0.0.1:1", "/t", "{}", "--plain", says=["'{}'"])
        self.refused("pub", "ws://127.0.0.1:1", "{}", "--plain", "--latch", says=["--latch"])
        self.refused("pub", "ws://127.0.0.1:1", "{}", "--plain", "-w", says=["--wait is for topics"])
        self.refused("pub", "ws://127.0.0.1:1", "/t", "{}", "-w", "--profile", "hop", says=["--wait"])
        self.refused("pub", "ws://127.0.0.1:1", "{}", "--plain", "--type", "x/T", says=["--type"])
        self.refused("pub", "ws://127.0.0.1:1", "{}", "--plain", "--ttl", "1s", "--timeout", "1s",
                     says=["exclude"])
        self.refused("peers", "ws://127.0.0.1:1", "more", says=["'more'"])

    def test_nothing_at_all_prints_the_help(self):
        ended = run(code=0, stdout=run("help").stdout, stderr=[])
        self.assertIn("usage: rowe VERB [arguments]    (`rowe VERB --help` says which)", ended.stdout)

    def test_urls_without_a_scheme_or_a_port_have_the_usual_ones(self):
        for url, whole in (("127.0.0.77", "ws://127.0.0.77:8080"), ("127.0.0.77:1", "ws://127.0.0.77:1"),
                           ("127.0.0.77/path", "ws://127.0.0.77:8080/path"), ("[::1]:1/p", "ws://[::1]:1/p"),
                           ("no-robot.invalid", "ws://no-robot.invalid:8080"), ("nobody", "ws://nobody:8080")):
            run("peers", url, "--timeout", "10ms", says=f"could not connect to {whole} within")

    def test_urls_that_are_none_say_what_one_looks_like(self):
        for url in ("/odom", '{"a":1}', "", "ftp://127.0.0.1/", "ws://", "ws://host:99999/", "ws://host:port/"):
            self.refused("echo", url, "/t", says=["ws[s]://HOST[:PORT][/PATH]"])

    def test_topics_that_are_none_are_refused(self):
        for name, why in ((b"/a\xff", "the argument name is not UTF-8 (at byte 2)"),
                          (b"/a\n", "the argument name has a control character (at byte 2)")):
            self.refused("echo", "ws://127.0.0.1:1", name, says=[why])
            self.refused("pub", "ws://127.0.0.1:1", name, "{}", says=[why])
            self.refused("call", "ws://127.0.0.1:1", name, says=[why])
        self.refused("echo", "ws://127.0.0.1:1", "x" * 300, says=["xxx", "300 bytes; it may have 128"])
        with tempfile.NamedTemporaryFile("w") as file:
            file.write("0 0 0 0 0 0 0 1\n")
            file.flush()
            self.refused("replay", "ws://127.0.0.1:1", "--tum", file.name, "--topic", "/rowe/mine",
                         says=["/rowe/mine", "the endpoint's own"])

    def test_parameters_and_values_that_are_no_utf8_are_named_with_the_byte(self):
        for which, verb, *words in (("name", "get", b"/a\xff"), ("name", "set", b"/a\xff", "1"),
                                    ("value", "set", "/a", b"\xc3\xa9\xff")):
            self.refused("param", verb, "127.0.0.1:1", *words,
                         says=[f"the argument {which} is not UTF-8 (at byte 2)"])

    def test_an_unknown_verb_or_option_suggests_the_nearest(self):
        self.refused("srve", says=["'srve'", "did you mean serve?"])
        self.refused("hlep", says=["did you mean help?"])
        self.refused("publish", says=["'publish'"])
        self.refused("cal", says=["did you mean call?"])
        self.refused("peers", "ws://127.0.0.1:1", "--token", "x", says=["did you mean --token-file?"])
        self.refused("serve", "--demmo", says=["'--demmo'", "did you mean --demo?"])
        self.refused("bag", says=["rowe: there is no verb 'bag'; did you mean record?"])
        self.refused("peers", "ws://127.0.0.1:1", "--json", "--bson", says=["'--bson'", "did you mean --json?"])
        self.refused("servics", says=["did you mean services?"])
        self.refused("sevre", says=["did you mean serve?"])
        self.refused("xyzzy-plugh", says=["'xyzzy-plugh'", "rowe help"])

    def test_a_number_below_0_says_how_it_is_written(self):
        run("param", "set", "127.0.0.1", "/x", "-0.1", code=2,
            first="unknown option '-0.1'; a number below 0 is written behind --: -- -0.1")

    def test_listening_beyond_loopback_needs_to_be_asked_for(self):
        self.refused("serve", "--listen", "0.0.0.0:0", says=["0.0.0.0", "--insecure"])

    def test_an_address_that_is_not_ours_is_refused(self):
        self.refused("serve", "--listen", "192.0.2.1:0", "--insecure", says=["192.0.2.1"], code=1)

    def test_help_begins_with_two_examples(self):
        explained = [verb for verb in verbs() if verb != "help"]
        for words in (["help"], ["--help"], *(["help", verb] for verb in explained),
                      *([verb, "-h"] for verb in explained),
                      *(["bench", mode, "--help"] for mode in bench_modes)):
            ended = run(*words, code=0, stderr=[])
            self.assertEqual(ended.stdout[0], "examples:")
            self.assertRegex(ended.stdout[1], r'^  (eval "\$\()?rowe ')
            self.assertRegex(ended.stdout[2], "^  rowe ")
            self.assertEqual(ended.stdout[3], "")

    def test_help_lists_every_verb_and_every_exit_code(self):
        text = "\n".join(run("help").stdout)
        these = ("serve", "config", "pub", "echo", "call", "peers", "record", "info", "replay", "setup",
                 "token", "discover", "doctor", "bench", "version")
        for word in (*these, "0", "1", "2", "3", "4", "5", "6", "130"):
            self.assertRegex(text, rf"(?m)^ +{word} ")
        for mode in bench_modes:
            self.assertRegex("\n".join(run("bench", "-h").stdout), rf"(?m)^  {mode} ")

    def test_version_is_one_line_and_one_json_object(self):
        self.assertRegex("\n".join(run("version").stdout), r"^rowe \d+\.\d+\.\d+$")
        described = json.loads("\n".join(run("version", "--json").stdout))
        self.assertRegex(described["version"], r"^\d+\.\d+\.\d+$")


if __name__ == "__main__":
    unittest.main()

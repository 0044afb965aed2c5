# SPDX-License-Identifier: Apache-2.0
"""`rowe doctor`, on machines that are files and on this one."""
import json
import os
import shutil
import signal
import subprocess
import tempfile
import unittest

from doctor.machines import entries, machine
from doctor.variants import CHECKS, KERNEL, VARIANTS, VM, rounds
from program import ROWE, on_a_terminal, program, run

KEYS = ["check", "group", "level", "visible", "title", "found", "wanted", "why", "change", "commands",
        "values"]


def lines_of(ended):
    return [json.loads(line) for line in ended.stdout]


def examined(root, *arguments):
    """{name: finding} of a machine; its cores are 2 and 3 unless arguments say otherwise."""
    where = () if "--cpu" in arguments else ("--cpu", "2,3")
    ended = run("doctor", "--root", root, "--json", *where, *arguments)
    assert ended.code == 0, ended.stderr
    return {one["check"]: one for one in lines_of(ended)}


def said(finding):
    """A finding in one word, as in CHECKS."""
    return finding["level"] if finding["visible"] else "unseen"


class doctor(unittest.TestCase):
    def test_each_check_speaks_in_each_of_its_levels(self):
        provoked = {"self_test": {"info"}}  # by test_the_self_test_can_be_left_out
        for group in rounds():
            with machine("rt_desktop", group["files"], group["trials"]) as root:
                findings = examined(root)
            for check, level, found, _, _ in group["variants"]:
                one = findings[check]
                with self.subTest(check=check, level=level, found=found):
                    self.assertEqual(said(one), level, one)
                    self.assertIn(found, one["found"])
                    if level == "unseen":
                        self.assertEqual(one["level"], "warn" if "fail" in CHECKS[check] else "info", one)
                provoked.setdefault(check, set()).add(level)
        self.assertEqual(sum(len(group["variants"]) for group in rounds()), len(VARIANTS))
        self.assertEqual({check: set(levels.split()) for check, levels in CHECKS.items()}, provoked)

    def test_changes_concern_the_check_they_are_for(self):
        """A change of one file leaves the other checks as they were, but for those that read it, too."""
        with machine("rt_desktop") as root:
            before = {name: said(one) for name, one in examined(root).items()}
        with machine("rt_desktop", {VM + "compact_unevictable_allowed": "1\n"}) as root:
            after = {name: said(one) for name, one in examined(root).items()}
        self.assertEqual({**before, "locked_pages": "warn"}, after)

    def test_every_line_has_the_same_keys_and_every_check_its_line(self):
        for name in ("virtual_machine", "container", "raspberry_pi_5", "rt_desktop"):
            with machine(name) as root:
                found = lines_of(run("doctor", "--root", root, "--json"))
            self.assertEqual([one["check"] for one in found], list(CHECKS))
            for one in found:
                self.assertEqual(list(one), KEYS)
                self.assertIn(one["level"], ("ok", "info", "warn", "fail"))
                self.assertIsInstance(one["visible"], bool)
                for key in ("title", "found", "wanted", "why", "change"):
                    self.assertTrue(one[key] and isinstance(one[key], str), one)
                self.assertTrue(all(isinstance(number, int) for number in one["values"].values()), one)
                self.assertTrue(all(isinstance(text, str) for text in one["commands"]), one)
                if one["level"] == "ok":
                    self.assertEqual(one["commands"], [], one)

    def test_numbers_are_there_for_programs(self):
        with machine("rt_desktop") as root:
            found = examined(root)
        self.assertEqual(found["clock_source"]["values"], {"read_ns": 19, "system_call_ns": 120})
        self.assertEqual(found["timers"]["values"], {"resolution_ns": 1, "tick_ns": 4000000})
        self.assertEqual(found["self_test"]["values"], {"cpu": 3, "fifo": 1, "count": 4000, "min_ns": 1500,
                                                        "p50_ns": 2300, "p99_ns": 4400, "max_ns": 11200,
                                                        "loop_timeout_ms": 100, "service_timeout_ms": 50})
        self.assertEqual(found["memory_lock"]["values"]["limit_bytes"], -1)
        self.assertGreater(found["memory_lock"]["values"]["endpoint_bytes"], 0)

    def test_strict_ends_with_5_when_a_check_fails_and_only_then(self):
        codes = {"virtual_machine": 5, "container": 5, "raspberry_pi_5": 5, "rt_desktop": 0}
        for name, code in codes.items():
            with machine(name) as root:
                self.assertEqual(run("doctor", "--root", root, "--strict").code, code, name)
                self.assertEqual(run("doctor", "--root", root, "--strict", "--json").code, code, name)
                self.assertEqual(run("doctor", "--root", root).code, 0, name)

    def test_the_verdict_says_what_it_rests_on(self):
        cases = ((None, None, "fit for real time"),
                 ({KERNEL + "nmi_watchdog": "1\n"}, None, "fit for real time, with reservations"),
                 (None, {"fifo": "fifo 1"}, "not fit for real time"),
                 (None, {"fifo": None}, "cannot be judged"))
        for files, trials, verdict in cases:
            with machine("rt_desktop", files, trials) as root:
                ended = run("doctor", "--root", root)
            self.assertEqual(ended.stdout[-1].split(":")[0], verdict)
            self.assertRegex(ended.stdout[-2], r"^\d+ fail, \d+ warn, \d+ info, \d+ ok")

    def test_a_machine_that_shows_nothing_is_never_in_order(self):
        with tempfile.TemporaryDirectory() as root:
            os.mkdir(root + "/proc")
            found = lines_of(run("doctor", "--root", root, "--json"))
            text = run("doctor", "--root", root)
        self.assertEqual([one["check"] for one in found], list(CHECKS))
        for one in found:
            self.assertNotEqual(one["level"], "ok", one)
            self.assertTrue(not one["visible"] or one["check"] in ("container", "fork"), one)
        self.assertIn("cannot be judged", text.stdout[-1])

    def test_nonsense_in_any_file_is_no_crash_and_no_broken_output(self):
        for nonsense in ("", "\n\n", "\x1b[31m\x07 \u00e9 \u009b", "-9223372036854775808", "9" * 400,
                         ",,,:::", "0-", "[", "] [", "some avg10=\n", "Max locked memory",
                         "Linux version 6", "1:cpu"):
            files = {path: nonsense for path, text in entries("rt_desktop").items()
                     if isinstance(text, str) and not path.endswith("/online")}
            with machine("rt_desktop", files) as root:
                found = lines_of(run("doctor", "--root", root, "--json"))
                text = "\n".join(run("doctor", "--root", root, "--verbose", "--fix-hints").stdout)
            self.assertEqual([one["check"] for one in found], list(CHECKS), nonsense)
            self.assertTrue(all(character.isprintable() or character == "\n" for character in text), nonsense)

    def test_cores_are_those_named_or_isolated_or_the_last(self):
        for name, arguments, cores in (("rt_desktop", (), "2-3"), ("rt_desktop", ("--cpu", "1"), "1"),
                                       ("virtual_machine", (), "1"),
                                       ("raspberry_pi_5", ("--cpu=0-1,3",), "0-1,3")):
            with machine(name) as root:
                self.assertTrue(run("doctor", "--root", root, *arguments).stdout[0].endswith(": " + cores))

    def test_arguments_that_make_no_sense_are_refused(self):
        with machine("rt_desktop") as root:
            for arguments, says in ((("--cpu", "two"), "'two'"), (("--cpu", "3,9"), "no cpu 9"),
                                    (("--quick", "--duration", "1s"), "exclude"),
                                    (("--duration", "5"), "'5'"), (("now",), "'now'")):
                run("doctor", "--root", root, *arguments, code=2, says=says)
        self.assertEqual(run("doctor", "--root", root + "/gone").code, 2)

    def test_hints_are_commands_for_what_is_not_in_order(self):
        with machine("virtual_machine") as root:
            without = run("doctor", "--root", root).stdout
            hints = run("doctor", "--root", root, "--fix-hints").stdout
        self.assertFalse([line for line in without if "how: " in line])
        self.assertIn("      how: sysctl -w vm.compact_unevictable_allowed=0", hints)
        self.assertIn("      how: apt install linux-image-rt-amd64 && reboot", hints)
        self.assertEqual([line for line in hints if "how: " not in line], without)

    def test_no_command_takes_the_last_core_from_the_machine(self):
        with machine("virtual_machine") as root:
            found = examined(root, "--cpu", "0,1")
        for check in ("isolation", "callbacks", "interrupts"):
            self.assertEqual(found[check]["commands"], [], check)
        self.assertIn("no other core is left", found["interrupts"]["found"])

    def test_quiet_leaves_what_fails_and_warns(self):
        with machine("container") as root:
            text = run("doctor", "--root", root, "--quiet").stdout
        marks = {line.split()[0] for line in text if line[:4] in ("ok  ", "info", "warn", "fail")}
        self.assertEqual(marks, {"warn", "fail"})

    def test_lines_fit_the_terminal_and_carry_no_colour(self):
        with machine("container") as root:
            text = on_a_terminal(72, "doctor", "--root", root)
        self.assertNotIn("\x1b", text)
        self.assertLessEqual(max(map(len, text.split("\n"))), 72)
        self.assertIn("fail  real-time kernel: PREEMPT_DYNAMIC", text)

    # ---- on this machine

    def test_this_machine_can_be_examined(self):
        ended = run("doctor", "--json", "--duration", "50ms", code=0)
        found = {one["check"]: one for one in lines_of(ended)}
        self.assertEqual(list(found), list(CHECKS))
        self.assertTrue(found["timers"]["visible"])
        self.assertGreater(found["clock_source"]["values"]["system_call_ns"], 0)
        values = found["self_test"]["values"]
        self.assertGreaterEqual(values["count"], 1)
        self.assertLessEqual(values["min_ns"], values["max_ns"])
        self.assertIn("measures wake-ups", "\n".join(ended.stderr))

    def test_the_self_test_can_be_left_out(self):
        ended = run("doctor", "--json", "--quick")
        last = lines_of(ended)[-1]
        self.assertEqual((last["check"], last["level"], last["found"]), ("self_test", "info", "left out"))
        self.assertNotIn("wake-ups", "\n".join(ended.stderr))

    def test_the_end_of_a_certificate_is_looked_at_where_one_is_named(self):
        def certificate_in(folder, file="certificate.pem"):
            ended = run("doctor", "--json", "--quick", "--certificate", os.path.join(folder, file), code=0)
            return lines_of(ended)[-1]

        with tempfile.TemporaryDirectory() as top:
            for days, level in ((10, "warn"), (29, "warn"), (31, "ok"), (397, "ok")):
                folder = os.path.join(top, str(days))
                run("setup", "--name", "ang-01", "--dir", folder, "--days", str(days), code=0)
                one = certificate_in(folder)
                self.assertEqual((one["check"], one["level"]), ("certificate_end", level), one)
                self.assertIn(one["values"]["days"], (days - 1, days))
            for wrong in ("key.pem", "nowhere.pem"):
                one = certificate_in(folder, wrong)
                self.assertEqual(one["level"], "fail", one)
                self.assertIn(wrong, one["found"])
        ended = run("doctor", "--json", "--quick")
        self.assertNotIn("certificate_end", [one["check"] for one in lines_of(ended)])

    def test_a_signal_ends_the_self_test_and_keeps_what_was_found(self):
        with program("doctor", "--duration", "10m") as running:
            running.line("measures wake-ups")
            running.line("^noise$", "stdout")
            self.assertEqual(running.end(signal.SIGINT), 0)
            self.assertRegex("\n".join(running.stdout), "cut short|interrupted before the first")
            self.assertRegex(running.stdout[-2], r"^\d+ fail")

    def test_an_ordinary_user_gets_every_line(self):
        if os.getuid() != 0:
            self.skipTest("the tests run as an ordinary user themselves")
        if shutil.which("setpriv") is None:
            self.skipTest("there is no setpriv (util-linux)")
        as_nobody = ("setpriv", "--reuid=65534", "--regid=65534", "--clear-groups", "--bounding-set=-all",
                     "--inh-caps=-all")
        if subprocess.run([*as_nobody, "test", "-x", ROWE], check=False).returncode != 0:
            self.skipTest("setpriv may not, or the program lies where others may not read it")
        ended = run("doctor", "--json", "--duration", "50ms", command=(*as_nobody, ROWE), code=0)
        found = {one["check"]: one for one in lines_of(ended)}
        self.assertEqual(list(found), list(CHECKS))
        self.assertIn("no CAP_SYS_NICE", found["sched_fifo"]["found"])
        self.assertEqual(found["self_test"]["values"]["fifo"], int(found["sched_fifo"]["level"] == "ok"))


if __name__ == "__main__":
    unittest.main()

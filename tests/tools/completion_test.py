# SPDX-License-Identifier: Apache-2.0
"""Completion in bash, zsh and fish, as these shells do it, and the manual pages."""
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

from program import ROWE, hub, program, run, timeout, verbs
from websocket import listener

folder = os.path.dirname(ROWE)


def words(*line, environment=None):
    said = run("complete", "--", *line, code=0, environment=environment or {}).stdout
    return [one.split("\t")[0] for one in said]


class candidates(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.demo = cls.enterClassContext(hub("--demo"))
        cls.at_demo = {"ROWE_URL": cls.demo.url}

    def test_are_verbs_first(self):
        self.assertEqual(set(words("")), set(verbs()))
        self.assertEqual(words("ec"), ["echo"])
        self.assertEqual(words("help", "ec"), ["echo"])
        self.assertEqual(words("bench", "l"), ["loop"])

    def test_are_options_and_their_values(self):
        self.assertIn("--timeout", words("echo", "--"))
        self.assertNotIn("--once", words("echo", "--once", "--"))
        self.assertEqual(words("echo", "--profile", "hop_"), ["hop_2014"])
        self.assertEqual(words("echo", "--profile=s"), ["--profile=standard"])
        self.assertEqual(words("completion", "z"), ["zsh"])
        self.assertEqual(words("record", "x", "--compression", ""), ["lz4", "zstd", "none"])
        self.assertEqual(words("top", "x", "--sort=b"), ["--sort=bytes"])
        self.assertEqual(words("record", "--output", ""), [":files"])
        self.assertEqual(words("info", ""), [":files"])
        self.assertEqual(words("echo", "--field", ""), [])
        self.assertEqual(words("plot", ""), [":files"])
        self.assertEqual(words("bench", "rpc", "--ma"), ["--max"])

    def test_are_what_the_robot_has(self):
        host = f"127.0.0.1:{self.demo.port}"
        self.assertEqual(words("echo", host, "/o"), ["/odom"])
        self.assertEqual(words("echo", host, "/odom", "/cmd"), ["/cmd_vel"])
        self.assertEqual(words("echo", "--once", "/o", environment=self.at_demo), ["/odom"])
        self.assertEqual(words("call", host, "/robot/"), ["/robot/set_speed"])
        self.assertEqual(words("info", host, "/robot/"), ["/robot/set_speed", ":files"])
        self.assertEqual(words("param", "get", host, "/robot/s"), ["/robot/speed_max"])

    def test_are_no_words_that_a_shell_would_carry_out(self):
        evil = ["/o;touch${IFS}owned", "/o`id`", "/o$(id)", "/o|id", "/o&", "/o>x", "/o'x", "/o x"]
        with listener() as there, program("complete", "--", "echo", there.url, "/o") as asking:
            with there.accept() as p:
                p.answer(p.called(), {"topics": [*evil, "/odom"], "types": ["x/T"] * 9})
                self.assertEqual(asking.end(), 0)
        self.assertEqual([line.split("\t")[0] for line in asking.stdout], ["/odom"])

    def test_are_none_where_nobody_answers(self):
        self.assertEqual(words("echo", "127.0.0.1:1", "/"), [])
        self.assertEqual(words("nonsense", ""), [])
        self.assertEqual(words("echo", "", "--nonsense", ""), [])


class shells(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.demo = cls.enterClassContext(hub("--demo"))
        cls.environment = {**os.environ, "PATH": f"{folder}:{os.environ['PATH']}", "ROWE_URL": cls.demo.url}

    def shell(self, name, script, *arguments):
        if not shutil.which(name):
            self.skipTest(f"{name} is not installed")
        with tempfile.TemporaryDirectory() as home:
            done = subprocess.run([name, *arguments], input=script, text=True, capture_output=True,
                                  timeout=timeout, env={**self.environment, "HOME": home}, check=False)
        return done.stdout, done.stderr

    def bash(self, line):
        script = f"""source <(rowe completion bash); compopt() {{ :; }}
COMP_LINE={line!r}; COMP_POINT=${{#COMP_LINE}}; _rowe; printf '%s\\n' "${{COMPREPLY[@]}}" """
        return self.shell("bash", script, "--norc")[0].split()

    def test_bash_completes(self):
        self.assertEqual(self.bash("rowe ec"), ["echo"])
        self.assertEqual(self.bash("rowe echo /o"), ["/odom"])
        self.assertEqual(self.bash("rowe echo --profile=hop_"), ["hop_2014"])  # readline's word is behind it
        self.assertIn("--once", self.bash("rowe echo --"))

    def test_bash_finds_the_program_below_the_home_folder(self):
        script = f"""mkdir "$HOME/bin"; ln -s {ROWE!r} "$HOME/bin/rowe"; source <(rowe completion bash)
compopt() {{ :; }}; COMP_LINE='~/bin/rowe ec'; COMP_POINT=${{#COMP_LINE}}; _rowe; echo "${{COMPREPLY[@]}}" """
        self.assertEqual(self.shell("bash", script, "--norc")[0].strip(), "echo")

    def test_fish_completes(self):
        out, err = self.shell("fish", "rowe completion fish | source\n"
                                      "complete -C 'rowe ec'\ncomplete -C 'rowe echo /o'\n", "--private")
        self.assertIn("echo\tprint the messages of topics\n", out, err)
        self.assertIn("/odom\tnav_msgs/Odometry\n", out)

    def test_zsh_reads_its_script(self):
        out, err = self.shell("zsh", "autoload -Uz compinit; compinit -u -D\nsource <(rowe completion zsh)\n"
                                     "print -r -- ${_comps[rowe]}\n", "-f")
        self.assertEqual(out.strip(), "_rowe", err)

    def test_a_shell_that_is_none_is_refused(self):
        run("completion", "csh", code=2, says="the shell is bash, zsh or fish, not 'csh'")


class manual(unittest.TestCase):
    def test_every_verb_has_a_page_that_groff_reads(self):
        with tempfile.TemporaryDirectory() as pages:
            run("man", "--output", pages, code=0, stdout=[], stderr=[])
            names = {path.name for path in pathlib.Path(pages).iterdir()}
            self.assertEqual({f"rowe-{verb}.1" for verb in verbs()} - {"rowe-help.1", "rowe-bench.1"},
                             {name for name in names if name.startswith("rowe-") and "bench" not in name})
            self.assertIn("rowe-bench-loop.1", names)
            for name in sorted(names):
                done = subprocess.run(["groff", "-man", "-Tascii", "-ww", "-rCHECKSTYLE=3",
                                       os.path.join(pages, name)], capture_output=True, text=True,
                                      timeout=timeout, check=False)
                self.assertEqual((name, done.returncode, done.stderr), (name, 0, ""))
                shown = re.sub(".\b", "", done.stdout)  # bold, as a line printer does it
                for heading in ("NAME", "SYNOPSIS", "DESCRIPTION", "EXIT STATUS"):
                    self.assertIn(heading, shown, name)

    def test_has_what_the_help_has(self):
        page = "\n".join(run("man", "echo", code=0).stdout)
        for part in (".TH ROWE-ECHO 1", "\\-\\-pretty", "rowe echo ws://127.0.0.1:8080 /odom",
                     ".SH EXAMPLES"):
            self.assertIn(part, page)
        said = subprocess.run(["groff", "-man", "-Tascii"], input="\n".join(run("man", "pub", code=0).stdout),
                              capture_output=True, text=True, timeout=timeout, check=True).stdout
        self.assertIn('"', said)
        run("man", "nonsense", code=2, says="there is no verb 'nonsense'")
        run("man", "--output", "/nowhere", code=1, says="cannot write '/nowhere/rowe.1'")


if __name__ == "__main__":
    unittest.main()

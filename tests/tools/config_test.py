# SPDX-License-Identifier: Apache-2.0
"""`rowe config`, and `rowe serve --config`: one file, one judge."""
import os
import re
import tempfile
import unittest

from program import hub, run

hash_a = "a" * 64
people = f"""
[access]
local_role = "observer"

[[role]]
name = "pilot"
publish = ["/cmd_vel"]

[[identity]]
name = "anna"
role = "pilot"
token_sha256 = "{hash_a}"
"""


def documented():
    with open(os.path.join(os.path.dirname(__file__), "../../docs/config.md")) as page:
        return page.read()


class config(unittest.TestCase):
    def file(self, text, mode=0o600):
        folder = self.enterContext(tempfile.TemporaryDirectory())
        path = os.path.join(folder, "rowe.toml")
        with open(path, "w") as out:
            out.write(text)
        os.chmod(path, mode)
        return path

    def test_check_says_what_is_wrong_and_so_does_serve(self):
        for text, says in (
                ("[endpoint]\nport = 70000\n", ":2: endpoint.port is out of range: 70000 (0 to 65535)"),
                ("[endpoint]\nprot = 1\n", ":2: endpoint.prot is no key; there are name, address, port, "),
                ('[endpoint]\naddress = "0.0.0.0"\n', ":2: endpoint.address is \"0.0.0.0\", "),
                ('[stop]\ntick = "20"\n', ':2: stop.tick needs a time such as "250 us"'),
                (people.replace('role = "pilot"', 'role = "captain"'),
                 ":9: identity `anna`: there is no role `captain`"),
                ("[serve]\nguarded = true\n", ":2: serve.guarded is for the robot of serve.demo, or --demo"),
                ("[endpoint\n", ":1: "),
        ):
            path = self.file(text)
            checked = run("config", "check", path, code=2, stdout=[], first=f"rowe config: {path}{says}")
            served = run("serve", "--config", path, code=2, stdout=[])
            self.assertEqual([line.removeprefix("rowe serve: ") for line in served.stderr],
                             [line.removeprefix("rowe config: ") for line in checked.stderr])

    def test_check_says_all_that_is_wrong(self):
        path = self.file("[endpoint]\nport = -1\nname = 5\n[limits]\ntopics_max = 0\n")
        ended = run("config", "check", path)
        self.assertEqual([line.split(": ")[1] for line in ended.stderr], [f"{path}:{n}" for n in (2, 3, 5)])

    def test_check_is_content_with_what_serve_takes(self):
        path = self.file('[endpoint]\nport = 0\nname = "from a file"\n[limits]\ntopics_max = 7\n' + people)
        run("config", "check", path, code=0, stdout=[f"{path}: no mistakes"], stderr=[])
        with hub("--config", path):
            pass

    def test_show_says_where_each_value_comes_from(self):
        path = self.file('[endpoint]\nport = 1\nname = "file"\ncpu = 0\n' + people)
        environment = {"ROWE_ENDPOINT_PORT": "2", "ROWE_ENDPOINT_NAME": "environment", "ROWE_CONFIG": path}
        for words in (("config", "show", path), ("config", "show")):
            shown = run(*words, "--name=here", "--demo", environment=environment, code=0, stderr=[])
            lines = [" ".join(line.split()) for line in shown.stdout]
            for line in ('name = "here" # --name', "port = 2 # ROWE_ENDPOINT_PORT", f"cpu = 0 # {path}:4",
                         "relay = true # default", "priority = 70 # default", "demo = true # --demo",
                         f'local_role = "observer" # {path}:7', f'publish = ["/cmd_vel"] # {path}:9'):
                self.assertIn(line, lines)

    def test_show_prints_a_file_that_says_the_same(self):
        path = self.file('[endpoint]\nname = "a \\"b\\" c"\nidle = "wake"\npoll_period = "1 ms"\n' + people)
        shown = run("config", "show", path).stdout
        again = run("config", "show", self.file("\n".join(shown))).stdout
        values = [[line.split("  #")[0].rstrip() for line in text] for text in (shown, again)]
        self.assertEqual(*values)

    def test_each_key_is_read_from_the_file_the_environment_and_the_command_line(self):
        usual = [line for line in run("config", "show").stdout if " = " in line]
        section, values = "", []
        for line in run("config", "show").stdout:
            section = line[1:-1] if line.startswith("[") else section
            if " = " in line:
                name, value = line.split("  #")[0].rstrip().split(" = ", 1)
                values.append((section, name, value))
        self.assertGreater(len(values), 60)
        plain = {(section, name): "" if value == "[]" else value.strip('"')
                 for section, name, value in values}

        environment = {f"ROWE_{section}_{name}".upper(): text for (section, name), text in plain.items()}
        shown = [line for line in run("config", "show", environment=environment).stdout if " = " in line]
        self.assertEqual([line.split("# ")[1] for line in shown], list(environment))

        path = self.file("\n".join(f"{section}.{name} = {value}" for section, name, value in values))
        shown = [line for line in run("config", "show", path).stdout if " = " in line]
        self.assertEqual([line.split("# ")[1] for line in shown],
                         [f"{path}:{n}" for n in range(1, len(usual) + 1)])

        # docs/config.md says which option a key has, and config/reference that it says so rightly.
        options = {(heading, name): option for heading, rows in re.findall(
            r"(?ms)^### \[(\w+)\]$(.*?)(?=^### |\Z)", documented())
            for name, option in re.findall(r"\| `(\w+)` \| `(--[\w-]+)` \|", rows)}
        has_option = [value != "[]" and section != "client" for section, _, value in values]
        words = [f"--limit={name}={plain[section, name]}" if section == "limits" else
                 f"{options[section, name]}={plain[section, name]}"
                 for (section, name, _), has in zip(values, has_option) if has]
        shown = [line for line in run("config", "show", *words).stdout if " = " in line]
        self.assertEqual([line.split("  #")[1].strip().startswith("--") for line in shown], has_option)

    def test_switches_of_the_command_line_can_be_turned_off(self):
        path = self.file('[endpoint]\naddress = "0.0.0.0"\ninsecure = true\n')
        self.assertEqual(run("config", "check", path).code, 0)
        run("serve", "--config", path, "--insecure=false", code=2, first="endpoint.address is \"0.0.0.0\"")
        self.assertIn("page = false", run("config", "show", "--page=false").stdout[4])
        self.assertIn('--page needs true or false, not "no"', run("config", "show", "--page=no").stderr[0])

    def test_identities_that_others_may_write_are_refused(self):
        path = self.file(people, mode=0o664)
        run("config", "check", path, code=2, first="may be written by its owner only")
        trusted = {"CREDENTIALS_DIRECTORY": os.path.dirname(path)}
        self.assertEqual(run("config", "check", path, environment=trusted).code, 0)

    def test_what_makes_no_sense_is_refused(self):
        for words, says in ((("check",), "needs a FILE"), (("test", "x"), "not 'test'"),
                            (("check", "/nowhere/rowe.toml"), "/nowhere/rowe.toml: the file cannot be read"),
                            (("show", "--listen", "127.0.0.1:1", "--port=1"), "excludes")):
            run("config", *words, code=2, stdout=[], first=says)


if __name__ == "__main__":
    unittest.main()

# SPDX-License-Identifier: Apache-2.0
"""`rowe token`: who may connect."""
import functools
import hashlib
import os
import re
import unittest

from program import in_parallel
from robot import roles
from robot_folder import in_a_folder


class tokens(in_a_folder):
    def setUp(self):
        super().setUp()
        self.set_up()

    def identities(self):
        return {one["name"]: one for one in self.settings()["identity"]}

    def refused(self, *arguments, says, code=1):
        before = self.text("r", "rowe.toml")
        self.rowe("token", *arguments, "--dir", "r", code=code, stdout=[], says=says)
        self.assertEqual(self.text("r", "rowe.toml"), before)

    def test_a_new_one_is_printed_and_only_its_hash_written(self):
        before = self.text("r", "rowe.toml")
        token, = self.rowe("token", "add", "anna", "supervisor", "--dir", "r").stdout
        self.assertRegex(token, r"^[\w-]{43}$")
        self.assertEqual(self.identities()["anna"],
                         {"name": "anna", "role": "supervisor",
                          "token_sha256": hashlib.sha256(token.encode()).hexdigest()})
        self.assertTrue(self.text("r", "rowe.toml").startswith(before))
        self.assertNotIn(token, self.text("r", "rowe.toml"))
        self.assertEqual(os.stat(self.at("r", "rowe.toml")).st_mode & 0o777, 0o600)
        self.rowe("token", "remove", "anna", "--dir", "r")
        self.assertEqual(self.text("r", "rowe.toml"), before)

    def test_one_for_urls_says_so_in_the_file(self):
        self.rowe("token", "add", "roslib", "observer", "--in-url", "--dir", "r")
        self.assertIs(self.identities()["roslib"]["token_in_url"], True)
        self.assertIn("roslib observer in-url", self.rowe("token", "list", "--dir", "r").stdout)

    def test_the_list_has_names_and_roles(self):
        listed = self.rowe("token", "list", "--dir", "r").stdout
        self.assertEqual(listed, [f"{role} {role}" for role in roles])

    def test_without_dir_it_is_the_folder_one_is_in(self):
        os.rename(self.at("r", "rowe.toml"), self.at("rowe.toml"))
        self.assertEqual(len(self.rowe("token", "list").stdout), 4)

    def test_many_at_once_are_all_there_afterwards(self):
        names = [f"n{number}" for number in range(8)]
        in_parallel(*(functools.partial(self.rowe, "token", "add", name, "driver", "--dir", "r")
                      for name in names))
        self.assertEqual({*self.identities()}, {*names, *roles})
        in_parallel(*(functools.partial(self.rowe, "token", "remove", name, "--dir", "r") for name in names))
        self.assertEqual({*self.identities()}, {*roles})

    def test_the_last_one_stays(self):
        for role in roles[1:]:
            self.rowe("token", "remove", role, "--dir", "r")
        self.refused("remove", "observer", says="everyone may do everything")

    def test_what_cannot_be_done_is_said_and_changes_nothing(self):
        self.refused("add", "driver", "driver",
                     says="'driver' is there already: `rowe token remove driver` first")
        self.refused("add", "anna", "pilot", says="there are observer, driver, supervisor, peer")
        self.refused("add", "an na", "driver", says="1 to 64 letters")
        self.refused("remove", "anna", says="no identity 'anna'")
        self.refused("add", "anna", says="add NAME ROLE", code=2)
        self.refused("remove", says="needs a NAME", code=2)
        self.refused("remove", "anna", "driver", says="add NAME ROLE", code=2)
        self.refused("list", "anna", says="add NAME ROLE", code=2)
        self.refused("steal", "anna", says="'steal'", code=2)
        self.refused("remove", "driver", "--in-url", says="--in-url", code=2)

    def test_a_file_that_was_written_otherwise_is_left_alone(self):
        self.write(self.text("r", "rowe.toml") + "[identity]\n", "r", "rowe.toml")
        line = self.text("r", "rowe.toml").count("\n")
        self.refused("add", "anna", "driver", says=f"rowe.toml: line {line}: an identity is a table")

    def test_comments_and_other_tables_stay(self):
        text = self.text("r", "rowe.toml")
        text = re.sub(r"(?m)^port = 8443$", "port = 8443 # mine", text)
        self.write(text + "\n# below\n[limits]\npeers_max = 9 # few\n", "r", "rowe.toml")
        self.rowe("token", "add", "anna", "driver", "--dir", "r")
        self.rowe("token", "remove", "supervisor", "--dir", "r")
        for line in ("port = 8443 # mine", "# below", "[limits]", "peers_max = 9 # few"):
            self.assertIn(line, self.text("r", "rowe.toml").split("\n"))
        self.assertEqual({*self.identities()}, {"observer", "driver", "peer", "anna"})


if __name__ == "__main__":
    unittest.main()

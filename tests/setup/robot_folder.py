# SPDX-License-Identifier: Apache-2.0
"""A set-up robot in a folder of its own, and what OpenSSL's program says of its certificate."""
import os
import re
import subprocess
import tempfile
import tomllib
import unittest

from program import run

roles = ("observer", "driver", "supervisor", "peer")


def openssl(*arguments, **options):
    """Its exit code, and all that it said."""
    ended = subprocess.run(["openssl", *arguments], capture_output=True, text=True, timeout=60, check=False,
                           **options)
    return ended.returncode, ended.stdout + ended.stderr


class in_a_folder(unittest.TestCase):
    def setUp(self):
        self.top = self.enterContext(tempfile.TemporaryDirectory())

    def at(self, *names):
        return os.path.join(self.top, *names)

    def text(self, *names):
        with open(self.at(*names), encoding="utf-8", newline="") as file:
            return file.read()

    def all_in(self, *names):
        """What each file of the folder holds."""
        folder = self.at(*names)
        found = {}
        for name in os.listdir(folder):
            with open(os.path.join(folder, name), "rb") as file:
                found[name] = file.read()
        return found

    def rowe(self, *arguments, code=0, **options):
        ended = run(*arguments, cwd=self.top, **options)
        self.assertEqual(ended.code, code, (arguments, ended.stdout, ended.stderr))
        return ended

    def set_up(self, *arguments, **options):
        """`rowe setup` of ang-01 in the folder r."""
        return self.rowe("setup", "--name", "ang-01", "--dir", "r", *arguments, **options)

    def settings(self, folder="r"):
        return tomllib.loads(self.text(folder, "rowe.toml"))

    def verdict(self, *asked, leaf="certificate.pem", folder="r"):
        return openssl("verify", "-x509_strict", "-purpose", "sslserver",
                       "-CAfile", self.at(folder, "ca.pem"), *asked, self.at(folder, leaf))


def tokens_of(ended):
    """The tokens that a run printed, by role."""
    found = (re.match(rf"({'|'.join(roles)}) +([\w-]{{43}})$", line) for line in ended.stdout)
    return {one[1]: one[2] for one in found if one}

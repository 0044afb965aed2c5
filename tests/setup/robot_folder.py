# SPDX-License-Identifier: Apache-2.0
"""A set-up robot in a folder of its own, and what OpenSSL's program says of its certificate."""
import os
import pathlib
import resource
import signal
import subprocess
import tempfile
import tomllib
import unittest

from program import run
from robot import content_of


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

    def write(self, text, *names, mode=0o600):
        path = pathlib.Path(self.at(*names))
        path.write_text(text, encoding="utf-8")
        path.chmod(mode)

    def all_in(self, *names):
        """What each file of the folder holds."""
        return content_of(self.at(*names))

    def rowe(self, *arguments, code=0, **options):
        return run(*arguments, cwd=self.top, code=code, **options)

    def set_up(self, *arguments, **options):
        """`rowe setup` of ang-01 in the folder r."""
        return self.rowe("setup", "--name", "ang-01", "--dir", "r", *arguments, **options)

    def settings(self, folder="r"):
        return tomllib.loads(self.text(folder, "rowe.toml"))

    def verdict(self, *asked, leaf="certificate.pem", folder="r"):
        return openssl("verify", "-x509_strict", "-purpose", "sslserver",
                       "-CAfile", self.at(folder, "ca.pem"), *asked, self.at(folder, leaf))


def full_after(size):
    """Options of run(): writing fails as on a full disk, but in the same place every time."""
    def small():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
    return {"preexec_fn": small, "restore_signals": False}

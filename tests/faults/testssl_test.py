# SPDX-License-Identifier: Apache-2.0
"""testssl.sh against a robot as `rowe setup` makes it; it asks nobody but the robot. Takes a minute."""
import json
import os
import shutil
import subprocess
import tempfile
import unittest

from robot import robot

command = shutil.which("testssl") or shutil.which("testssl.sh")  # Debian calls it the one
seconds_max = 600
above_low = ("MEDIUM", "HIGH", "CRITICAL", "FATAL")
# Protocols, ciphers by strength, forward secrecy, defaults and the certificate, preferences, headers of HTTP,
# all vulnerabilities that it knows.
checks = ("-p", "-s", "-f", "-S", "-P", "-h", "-U")

# What is found and stays so. That there is no HSTS is LOW: a browser that was told of it lets nobody accept
# the robot's certificate by hand any more, and asks every other port of that name for https.
accepted = {
    # A private root's certificates name nobody who could be asked: no CRL, no OCSP. What is revoked is a
    # token; a key that was stolen is replaced with its root.
    "cert_revocation": "Neither CRL nor OCSP URI provided",
}
# Each of these says that a check was made and what it found, so none is left out when the tool changes.
found_good = {
    "SSLv2": "not offered", "SSLv3": "not offered", "TLS1": "not offered", "TLS1_1": "not offered",
    "TLS1_2": "offered", "TLS1_3": "offered", "cipherlist_NULL": "not offered",
    "cipherlist_aNULL": "not offered", "cipherlist_AVERAGE": "not offered", "cipherlist_STRONG": "offered",
    "PFS_ECDHE_curves": "prime256v1 X25519", "cipher_order": "server", "TLS_session_ticket": "no",
    "sessionresumption_ID": "no resumption", "cert_chain_of_trust": "passed", "cert_trust": "Ok via SAN",
    "X-Content-Type-Options": "nosniff", "heartbleed": "not vulnerable", "secure_renego": "supported",
    "secure_client_renego": "not vulnerable", "CRIME_TLS": "not vulnerable",
    "fallback_SCSV": "no protocol below TLS 1.2 offered",
}


@unittest.skipIf(command is None, "there is no command testssl (package testssl.sh)")
class testssl(unittest.TestCase):
    def test_finds_nothing_above_low(self):
        with tempfile.TemporaryDirectory() as folder, robot() as bot, bot.serving("--quiet") as serving:
            report = os.path.join(folder, "report.json")
            run = subprocess.run(
                [command, "--quiet", "--color", "0", "--warnings", "off", "--nodns", "none",
                 "--ip", "127.0.0.1", "--add-ca", bot.ca, "--jsonfile", report, *checks,
                 f"https://127.0.0.1:{serving.port}/"],
                stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=seconds_max, check=False,
                cwd=folder)
            with open(report, encoding="utf-8") as file:
                findings = json.load(file)
        bad = [one for one in findings if one["severity"] in above_low]
        unexpected = [one for one in bad if accepted.get(one["id"], "\0") not in one["finding"]]
        self.assertEqual(unexpected, [], run.stdout)
        by_id = {one["id"]: one["finding"] for one in findings}
        for what, says in found_good.items():
            self.assertIn(says, by_id.get(what, "was not looked at"), what)


class what_is_compressed(unittest.TestCase):
    """BREACH guesses a secret from the length of a compressed answer that holds it beside what the attacker
    chose."""

    def test_is_nothing_under_tls(self):
        with robot() as bot, bot.serving() as serving:
            for path in ("/", "/app.js", "/style.css", "/metrics", "/healthz", "/nowhere"):
                fields = bot.get(serving, path, "supervisor", {"Accept-Encoding": "gzip"})[1]
                self.assertNotIn("content-encoding", fields, path)


if __name__ == "__main__":
    unittest.main()

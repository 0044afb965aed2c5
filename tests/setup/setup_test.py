# SPDX-License-Identifier: Apache-2.0
"""`rowe setup`: what it makes, judged by OpenSSL's own program and by Python's reader of TOML; and that it
makes all or nothing."""
import base64
import hashlib
import os
import stat
import subprocess
import unittest
import xml.etree.ElementTree as xml

from program import ROWE, run, timeout
from robot import roles, tokens_of
from robot_folder import full_after, in_a_folder, openssl


class made(in_a_folder):
    def x509(self, *asked, of="certificate.pem"):
        code, said = openssl("x509", "-in", self.at("r", of), *asked)
        self.assertEqual(code, 0, said)
        return said

    def test_a_certificate_that_is_good_by_name_and_by_address(self):
        self.set_up("--host", "gate.example", "--host", "203.0.113.7")
        for name in ("ang-01.local", "localhost", "ang-01", "gate.example"):
            self.assertEqual(self.verdict("-verify_hostname", name)[0], 0, name)
        for address in ("127.0.0.1", "::1", "203.0.113.7"):
            self.assertEqual(self.verdict("-verify_ip", address)[0], 0, address)
        self.assertIn("hostname mismatch", self.verdict("-verify_hostname", "ang-02.local")[1])
        self.assertIn("IP address mismatch", self.verdict("-verify_ip", "10.9.9.9")[1])

    def test_a_certificate_for_a_server_and_nothing_else(self):
        self.set_up()
        said = self.x509("-noout", "-text")
        for part in ("CA:FALSE", "Digital Signature", "TLS Web Server Authentication", "prime256v1",
                     "ecdsa-with-SHA256", "Issuer: O = rowe, CN = root of ang-01"):
            self.assertIn(part, said)
        self.assertNotIn("Certificate Sign", said)
        said = self.x509("-noout", "-text", of="ca.pem")
        for part in ("CA:TRUE, pathlen:0", "Name Constraints: critical", "DNS:local\n",
                     "IP:10.0.0.0/255.0.0.0", "Certificate Sign"):
            self.assertIn(part, said)

    def test_the_key_of_the_certificate(self):
        self.set_up()
        of_key = openssl("pkey", "-in", self.at("r", "key.pem"), "-pubout")[1]
        self.assertEqual(of_key, self.x509("-noout", "-pubkey"))

    def test_one_root_in_two_forms(self):
        self.set_up()
        form = ("-noout", "-fingerprint", "-sha256")
        self.assertEqual(self.x509(*form, of="ca.pem"), self.x509("-inform", "DER", *form, of="ca.crt"))

    def test_the_fingerprint_that_is_printed_is_that_of_the_certificate(self):
        made = self.set_up()
        shown = self.x509("-noout", "-fingerprint", "-sha256")
        made.expect(says=shown.strip().split("=")[1])

    def test_the_pin_that_is_printed_is_that_of_the_certificates_key(self):
        made = self.set_up()
        of_key = self.x509("-noout", "-pubkey")
        pin = hashlib.sha256(base64.b64decode("".join(of_key.strip().splitlines()[1:-1]))).hexdigest()
        made.expect(says=f"--pin {pin}")
        found = self.rowe("doctor", "--json", "--quick", "--certificate", "r/certificate.pem").stdout[-1]
        self.assertIn(pin, found)

    def test_a_root_that_can_vouch_for_no_other_name(self):
        self.set_up("--keep-ca")
        for name, verdict in (("DNS:bank.example", "permitted subtree violation"),
                              ("IP:8.8.8.8", "permitted subtree violation"), ("DNS:other.local", "OK")):
            self.write("basicConstraints=critical,CA:FALSE\nsubjectKeyIdentifier=hash\n"
                       f"authorityKeyIdentifier=keyid\nsubjectAltName={name}\n", "extensions")
            key = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-keyout", self.at("key"))
            code, said = openssl("req", "-new", *key, "-nodes", "-subj", "/O=forger",
                                 "-out", self.at("request"))
            self.assertEqual(code, 0, said)
            root = ("-CA", self.at("r", "ca.pem"), "-CAkey", self.at("r", "ca-key.pem"))
            code, said = openssl("x509", "-req", "-in", self.at("request"), *root,
                                 "-extfile", self.at("extensions"), "-out", self.at("r", "forged.pem"))
            self.assertEqual(code, 0, said)
            self.assertIn(verdict, self.verdict(leaf="forged.pem")[1], name)

    def test_settings_that_name_all_of_it(self):
        ended = self.set_up("--port", "9443", "--host", "gate.example", "--host", "fd00::7")
        settings = self.settings()
        endpoint = settings["endpoint"]
        self.assertEqual((endpoint["name"], endpoint["address"]), ("ang-01", "0.0.0.0"))
        self.assertEqual(endpoint["port"], 9443)
        for host in ("ang-01.local", "gate.example", "[fd00::7]"):
            self.assertIn(host, endpoint["allow_hosts"])
        self.assertEqual(settings["tls"], {"certificate": "certificate.pem", "key": "key.pem"})
        tokens = tokens_of(ended)
        self.assertEqual(tuple(tokens), roles)
        hashes = {role: hashlib.sha256(tokens[role].encode()).hexdigest() for role in roles}
        self.assertEqual(settings["identity"],
                         [{"name": role, "role": role, "token_sha256": hashes[role]} for role in roles])

    def test_secrets_that_only_their_owner_reads(self):
        before = os.umask(0)
        self.addCleanup(os.umask, before)
        self.set_up("--keep-ca", "--save-tokens")
        modes = {name: stat.S_IMODE(os.stat(self.at("r", name)).st_mode) for name in os.listdir(self.at("r"))}
        secret = ("rowe.toml", "key.pem", "ca-key.pem", "tokens.txt")
        public = ("certificate.pem", "ca.pem", "ca.crt", "rowe.service")
        self.assertEqual(modes, dict.fromkeys(secret, 0o600) | dict.fromkeys(public, 0o644))
        self.assertEqual(stat.S_IMODE(os.stat(self.at("r")).st_mode), 0o700)

    def test_no_file_with_a_token_or_the_roots_key_unless_that_is_asked_for(self):
        tokens = tokens_of(self.set_up())
        self.assertNotIn("ca-key.pem", os.listdir(self.at("r")))
        self.assertNotIn("tokens.txt", os.listdir(self.at("r")))
        for name, content in self.all_in("r").items():
            for token in tokens.values():
                self.assertNotIn(token.encode(), content, name)
        tokens = tokens_of(self.set_up("--force", "--save-tokens"))
        self.assertEqual(self.text("r", "tokens.txt"), "".join(f"{role} {tokens[role]}\n" for role in roles))

    def test_links_with_the_drivers_token_behind_a_hash_sign(self):
        ended = self.set_up("--port", "9443", "--address", "192.0.2.1")
        token = tokens_of(ended)["driver"]
        links = [line.strip() for line in ended.stdout if "https://" in line]
        self.assertEqual(len(links), 2)
        self.assertRegex(links[0], rf"^https://[\w.-]+\.local:9443/#token={token}$")
        self.assertEqual(links[1], f"https://192.0.2.1:9443/#token={token}")
        self.assertNotIn(token, "\n".join(ended.stderr))

    def test_no_link_that_nobody_serves(self):
        for address, host in (("127.0.0.1", "127.0.0.1"), ("::1", "[::1]")):
            ended = self.set_up("--address", address, "--force",
                                says=f"only programs on this machine reach {address}")
            links = [line.split("#")[0] for line in ended.stdout if "https://" in line]
            self.assertEqual(links, [f"https://{host}:8443/"])

    def test_no_hints_where_none_are_wanted(self):
        said = "\n".join(self.set_up("--quiet").stderr)
        self.assertIn("SHA-256 ", said)
        for hint in ("next:", "to announce", "phones", "--pin"):
            self.assertNotIn(hint, said)
            self.assertIn(hint, "\n".join(self.set_up("--force").stderr))

    def test_links_with_the_token_of_whom_one_likes(self):
        ended = self.set_up("--link", "supervisor", "--address", "127.0.0.1", says="that of the supervisor")
        token = tokens_of(ended)["supervisor"]
        self.assertEqual(ended.stdout[-1], f"https://127.0.0.1:8443/#token={token}")

    def test_every_set_up_its_own_secrets(self):
        one, other = tokens_of(self.set_up()), tokens_of(self.set_up("--force"))
        self.assertEqual(len({*one.values(), *other.values()}), 8)

    def test_a_service_for_avahi(self):
        self.set_up("--port", "9443")
        group = xml.fromstring(self.text("r", "rowe.service"))
        self.assertEqual(group.find("name").text, "ang-01")
        services = {one.find("type").text: one for one in group.findall("service")}
        self.assertEqual({*services}, {"_rowe._tcp", "_https._tcp"})
        for one in services.values():
            self.assertEqual(one.find("port").text, "9443")
            self.assertEqual({text.text for text in one.findall("txt-record")},
                             {"path=/", "scheme=https", "name=ang-01", "api=rowe.v1"})

    def test_the_folder_is_named_after_the_robot(self):
        self.rowe("setup", "--name", "ang-07")
        self.assertEqual(os.listdir(self.top), ["rowe-ang-07"])


class announcing(in_a_folder):
    def in_a_world_of_its_own(self, script):
        """Runs it where /etc is empty but for what the script makes."""
        if subprocess.run(["unshare", "-rm", "true"], check=False, capture_output=True).returncode != 0:
            self.skipTest("this machine makes no mount namespace for this user")
        return subprocess.run(["unshare", "-rm", "sh", "-c", "mount -t tmpfs none /etc && " + script],
                              cwd=self.top, capture_output=True, text=True, check=False, timeout=timeout)

    def test_puts_the_service_where_avahi_finds_it(self):
        services = "/etc/avahi/services"
        make = f"{ROWE} setup --name ang-01 --dir r --avahi >said"
        show = f"ls {services} && cat {services}/*"
        ended = self.in_a_world_of_its_own(f"mkdir -p {services} && {make} && {show}")
        self.assertEqual(ended.stdout, "rowe-ang-01.service\n" + self.text("r", "rowe.service"), ended.stderr)

    def test_makes_nothing_where_there_is_no_avahi(self):
        ended = self.in_a_world_of_its_own(f"{ROWE} setup --name ang-01 --dir r --avahi")
        self.assertEqual(ended.returncode, 1)
        self.assertIn("/etc/avahi/services cannot be opened", ended.stderr)
        self.assertIn("avahi-daemon", ended.stderr)
        self.assertEqual((ended.stdout, os.listdir(self.top)), ("", []))


class all_or_nothing(in_a_folder):
    def test_what_is_there_stays_as_it_is_unless_it_is_to_go(self):
        self.set_up()
        before = self.all_in("r")
        self.set_up(code=1, stdout=[], says="r is there already, with 6 files")
        self.assertEqual(self.all_in("r"), before)
        self.set_up("--force")
        self.assertEqual({*self.all_in("r")}, {*before})
        self.assertNotEqual(self.all_in("r")["key.pem"], before["key.pem"])
        self.assertEqual(os.listdir(self.top), ["r"])

    def test_force_replaces_nothing_that_set_up_does_not_make(self):
        os.mkdir(self.at("r"))
        self.write("x", "r", "thesis.tex")
        self.set_up("--force", code=1, says="thesis.tex")
        self.assertEqual(self.all_in("r"), {"thesis.tex": b"x"})

    def fails_when_files_are_full_after(self, size, *arguments):
        # It prints no token of a robot that there is not.
        self.set_up(*arguments, code=1, stdout=[], says="cannot be written", **full_after(size))

    def test_a_full_disk_leaves_nothing_behind(self):
        for size in (0, 1, 200, 300, 700, 900, 1200):  # each lets some more of the files through
            self.fails_when_files_are_full_after(size)
            self.assertEqual(os.listdir(self.top), [], size)

    def test_a_full_disk_leaves_an_earlier_set_up_alone(self):
        self.set_up()
        before = self.all_in("r")
        for size in (0, 300, 900):
            self.fails_when_files_are_full_after(size, "--force")
            self.assertEqual(self.all_in("r"), before)
            self.assertEqual(os.listdir(self.top), ["r"])

    def test_a_folder_that_cannot_be_made_is_named(self):
        for where in ("/proc/rowe", self.at("no", "such")):
            run("setup", "--name", "ang-01", "--dir", where, code=1, says=f"{where} cannot be made")
        self.assertEqual(os.listdir(self.top), [])

    def test_wrong_arguments_make_nothing(self):
        for line, says in (("--name a.b", ["'a.b'", "1 to 48"]), (f"--name {'x' * 49}", ["1 to 48"]),
                           ("--host dev", ["'dev'", "top-level"]), ("--host a,IP:8.8.8.8", ["--host"]),
                           ("--address robot", ["--address", "'robot'"]), ("--port 0", ["1 to 65535"]),
                           ("--days 825", ["1 to 824"]), ("--renew", ["--dir"]),
                           ("--renew --dir r --keep-ca", ["alone"]),
                           ("--renew --dir r --port 1", ["alone"]), ("--link pilot", ["observer or driver"])):
            self.rowe("setup", *line.split(), code=2, says=says)
            self.assertEqual(os.listdir(self.top), [])


class renewing(in_a_folder):
    def test_makes_a_new_certificate_under_the_old_root(self):
        self.set_up("--keep-ca", "--days", "10", "--host", "gate.example")
        before = self.all_in("r")
        self.assertRegex(self.rowe("setup", "--renew", "--dir", "r", "--days", "20").stdout[0],
                         r"^renewed: valid until \d{4}-\d\d-\d\d$")
        after = self.all_in("r")
        self.assertEqual([name for name in before if before[name] != after[name]], ["certificate.pem"])
        self.assertEqual({*after}, {*before})
        self.assertEqual(self.verdict("-verify_hostname", "gate.example")[0], 0)
        in_15_days = ("x509", "-in", self.at("r", "certificate.pem"), "-noout", "-checkend", str(15 * 86400))
        self.assertEqual(openssl(*in_15_days)[0], 0)

    def test_says_what_to_do_where_the_roots_key_is_gone(self):
        self.set_up()
        before = self.all_in("r")
        self.rowe("setup", "--renew", "--dir", "r", code=1, says=("r/ca-key.pem is not there", "--keep-ca"))
        self.assertEqual(self.all_in("r"), before)


if __name__ == "__main__":
    unittest.main()

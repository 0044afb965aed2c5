# SPDX-License-Identifier: Apache-2.0
"""Who has no header and no subprotocol for a token: the form of the log-in, its cookie, and certificates of
clients; and who abuses them. Raw requests over TLS, by Python's own ssl, to a robot as `rowe setup` makes it.
"""
import os
import re
import socket
import ssl
import subprocess
import unittest

from program import kept_port, learns, program, run, timeout
from robot import tokens_of
from robot_folder import full_after, in_a_folder, openssl

key = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ=="
upgrade = ("Connection: Upgrade", "Upgrade: websocket", "Sec-WebSocket-Version: 13", key)


class credentials(in_a_folder):
    def setUp(self):
        super().setUp()
        self.tokens = tokens_of(self.set_up("--keep-ca"))
        self.port = self.enterContext(kept_port())
        self.cookie = f"__Host-rowe-{self.port}"

    def serve(self, client_ca="ca.pem", more=()):
        text = self.text("r", "rowe.toml")
        if client_ca:
            text = text.replace("[tls]\n", f'[tls]\nclient_ca = "{client_ca}"\n')
            self.write(text, "r", "rowe.toml")
        self.robot = program("serve", "--demo", "--config", self.at("r", "rowe.toml"), "--address",
                             "127.0.0.1", "--port", str(self.port), *more)
        self.addCleanup(self.robot.process.kill)
        self.robot.line(r"rowe serves https://", stream="stdout")

    def connected(self, certificate=None, protocol=None):
        context = ssl.create_default_context(cafile=self.at("r", "ca.pem"))
        if protocol:
            context.maximum_version = protocol
        if certificate:
            context.load_cert_chain(self.at(certificate))
        made = context.wrap_socket(socket.create_connection(("127.0.0.1", self.port), timeout),
                                   server_hostname="127.0.0.1")
        self.addCleanup(made.close)
        return made

    def answer(self, *lines, body=b"", by=None):
        """The status and the header of what is answered. The connection stays open after 101."""
        by = by or self.connected()
        host = [] if any(line.startswith("Host:") for line in lines) else [f"Host: 127.0.0.1:{self.port}"]
        by.sendall("\r\n".join([lines[0], *host, *lines[1:], "", ""]).encode("latin-1") + body)
        header = b""
        while not header.endswith(b"\r\n\r\n"):
            one = by.recv(1)
            self.assertTrue(one, f"no answer to {lines}: {header}")
            header += one
        return int(header.split()[1]), header.decode("latin-1")

    def upgraded(self, *more, by=None):
        return self.answer("GET / HTTP/1.1", *upgrade, *more, by=by)[0]

    def posted(self, body, *more, length=None, origin=None):
        own = f"Origin: https://127.0.0.1:{self.port}"
        lines = [own if origin is None else origin, "Content-Type: application/x-www-form-urlencoded",
                 f"Content-Length: {len(body)}" if length is None else length]
        return self.answer("POST /rowe/login HTTP/1.1", *filter(None, lines), *more, body=body.encode())

    def logged_in(self, name="driver"):
        status, header = self.posted(f"token={self.tokens[name]}")
        self.assertEqual(status, 303, header)
        found = re.search(r"\r\nSet-Cookie: ([^=]+)=([^;]+); Path=/; HttpOnly; SameSite=Strict; Secure\r\n",
                          header)
        self.assertEqual(found[1], self.cookie)
        return found[2]

    def ends(self, connection):
        """What is read of it until it ends."""
        connection.settimeout(timeout)
        said = b""
        try:
            while part := connection.recv(65536):
                said += part
        except (ConnectionError, ssl.SSLError):
            pass
        return said

    # ---- the cookie

    def test_a_cookie_is_a_credential_on_every_way(self):
        self.serve(client_ca=None)
        self.assertEqual(self.upgraded(), 401)
        token = self.logged_in()
        self.assertEqual(token, self.tokens["driver"])
        for text, status in ((f"a=b; {self.cookie}={token}; c", 101), (f"{self.cookie}={token}x", 401),
                             (f"rowe-{self.port}={token}", 401),
                             (f"{self.cookie}={token}; x={'x' * 4096}", 431)):
            self.assertEqual(self.upgraded(f"Cookie: {text}"), status, text)
        self.assertEqual(self.answer("GET /metrics HTTP/1.1", f"Cookie: {self.cookie}={token}")[0], 200)
        self.assertEqual(self.answer("GET /metrics HTTP/1.1")[0], 401)

    def test_a_cookie_does_nothing_for_other_origins(self):
        self.serve(client_ca=None)
        shown = f"Cookie: {self.cookie}={self.logged_in()}"
        self.assertEqual(self.upgraded(shown, f"Origin: https://127.0.0.1:{self.port}"), 101)
        for origin in ("https://evil.example", "null", f"http://127.0.0.1:{self.port}",
                       f"https://127.0.0.1:{self.port + 1}"):
            self.assertEqual(self.upgraded(shown, f"Origin: {origin}"), 403, origin)

    def test_the_form_is_small_and_without_script(self):
        self.serve(client_ca=None)
        by = self.connected()
        status, header = self.answer("GET /rowe/login HTTP/1.1", by=by)
        self.assertEqual(status, 200)
        self.assertIn("content-security-policy: default-src 'none'; style-src 'self'", header)
        self.assertIn("form-action 'self'", header)
        self.assertNotIn("script-src", header)
        self.assertIn("referrer-policy: same-origin", header)
        self.assertNotIn(b"<script", self.ends(by))

    # ---- abuse of the form

    def test_forms_that_are_not_right_are_refused_at_once(self):
        self.serve(client_ca=None)
        right = f"token={self.tokens['driver']}"
        cases = [
            (411, dict(body=right, length=f"Content-Length: {len(right)}\r\nTransfer-Encoding: chunked")),
            (413, dict(body="x" * 600)),
            (400, dict(body=right, length=f"Content-Length: {len(right)}\r\nContent-Length: 1")),
            (400, dict(body=f"{right}&{right}")),
            (401, dict(body="token=" + "x" * 500)),
            (401, dict(body=f"{right}%00")),
            (401, dict(body=f"{right}%0d%0aSet-Cookie:%20a=b")),
            (403, dict(body=right, origin=f"Origin: http://127.0.0.1:{self.port}")),
        ]
        for status, how in cases:
            with self.subTest(how):
                # A wrong token is answered late from the sixth on, and by 429.
                found, header = self.posted(**how)
                self.assertIn(found, (status, 429) if status == 401 else (status,), header)
                self.assertNotIn("Set-Cookie", header)
        self.logged_in()  # a right one is prompt

    def test_no_log_has_a_token(self):
        self.serve(client_ca=None)
        token = self.logged_in()
        self.posted(f"token={token}x")
        self.upgraded(f"Cookie: {self.cookie}={token}y")
        self.upgraded(f"Cookie: {self.cookie}={token}", "Origin: https://evil.example")
        self.answer("GET / HTTP/1.1", f"Cookie : {self.cookie}={token}")
        self.robot.line(r"name is malformed")
        said = "\n".join(self.robot.said["stdout"] + self.robot.said["stderr"])
        self.assertNotIn(token[:20], said)

    def test_removing_who_logged_in_ends_its_connections(self):
        self.serve(client_ca=None)
        by = self.connected()
        self.assertEqual(self.upgraded(f"Cookie: {self.cookie}={self.logged_in()}", by=by), 101)
        self.rowe("token", "remove", "driver", "--dir", "r")
        self.assertIn(b"token revoked", self.ends(by))
        self.assertEqual(self.upgraded(f"Cookie: {self.cookie}={self.tokens['driver']}"), 401)

    def test_removing_somebody_counts_whatever_else_is_wrong(self):
        os.mkdir(self.at("site"))
        self.write(self.tokens["peer"], "shown")
        shown = f'[client]\ntoken_file = "{self.at("shown")}"\n[tls]\n'
        self.write(self.text("r", "rowe.toml").replace("[tls]\n", shown), "r", "rowe.toml")
        self.serve(client_ca=None, more=("--web", self.at("site")))
        breaking = {
            "driver": (lambda: os.chmod(self.at("r", "key.pem"), 0o644), "key.pem: others can read it"),
            "observer": (lambda: os.chmod(self.at("shown"), 0o644), r"client.token_file: .*others can read"),
            "peer": (lambda: open(self.at("site", "a 2x.png"), "wb").close(), "a 2x.png"),
            "supervisor": (lambda: self.certificate("arm-1"), "has only a certificate"),
        }
        for name, (how, says) in breaking.items():
            with self.subTest(name):
                by = self.connected()
                shown = f"Authorization: Bearer {self.tokens[name]}"
                self.assertEqual(self.upgraded(shown, by=by), 101)
                how()
                self.rowe("token", "remove", name, "--dir", "r")
                self.assertIn(b"token revoked", self.ends(by))
                self.assertEqual(self.upgraded(shown), 401)
                self.robot.line(says)
        self.robot.line("a restart would be refused", count=4)

    # ---- certificates

    def certificate(self, name, role="driver"):
        file = f"{name}.pem"
        self.rowe("token", "add", name, role, "--certificate", file, "--dir", "r")
        return file

    def test_a_certificate_lets_in_and_its_identity_ends_it(self):
        arm = self.certificate("arm.1")  # no host's name, though it looks like one
        self.assertEqual(os.stat(self.at(arm)).st_mode & 0o777, 0o600)
        code, said = openssl("verify", "-x509_strict", "-purpose", "sslclient", "-CAfile",
                             self.at("r", "ca.pem"), self.at(self.certificate("screen", "observer")))
        self.assertEqual(code, 0, said)
        self.serve()
        self.assertEqual(self.upgraded(), 401, "one is asked for, and nobody has to have one")
        self.assertEqual(self.upgraded(f"Authorization: Bearer {self.tokens['driver']}"), 101)
        for protocol in (ssl.TLSVersion.TLSv1_2, ssl.TLSVersion.TLSv1_3):
            self.assertEqual(self.upgraded(by=self.connected(arm, protocol)), 101, protocol)
        self.assertEqual(self.answer("GET /metrics HTTP/1.1", by=self.connected("screen.pem"))[0], 200)
        wrong = f"Authorization: Bearer {'x' * 43}"
        self.assertEqual(self.upgraded(wrong, by=self.connected(arm)), 401, "a token that is shown counts")
        by = self.connected(arm)
        self.assertEqual(self.upgraded(by=by), 101)
        self.rowe("token", "remove", "arm.1", "--dir", "r")
        self.assertIn(b"token revoked", self.ends(by))
        self.assertEqual(self.upgraded(by=self.connected(arm)), 401, "it is nobody's now")

    def test_the_verbs_show_one(self):
        arm = self.at(self.certificate("arm-1"))
        self.serve()
        url = f"wss://127.0.0.1:{self.port}"
        root = ("--ca", self.at("r", "ca.pem"))
        run("peers", url, *root, "--cert", arm, code=0)
        run("peers", url, *root, "--cert", arm, "--key", arm, code=0)
        learns("401", "peers", url, *root).expect(3, says="401")
        run("peers", url, environment={"ROWE_CA": root[1], "ROWE_CERT": arm}, code=0)
        os.chmod(arm, 0o644)
        self.assertIn("others can read it", "\n".join(run("peers", url, *root, "--cert", arm).stderr))

    def test_one_of_another_root_is_refused_by_the_handshake(self):
        self.certificate("arm-1")
        self.serve()
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256",
                        "-nodes", "-days", "1", "-subj", "/CN=arm-1", "-keyout", self.at("k.pem"),
                        "-out", self.at("c.pem")], check=True, capture_output=True, timeout=60)
        self.write(self.text("c.pem") + self.text("k.pem"), "eve.pem")
        with self.assertRaises((ssl.SSLError, ConnectionError)):
            by = self.connected("eve.pem")
            by.sendall(b"GET / HTTP/1.1\r\n\r\n")
            if by.recv(100) == b"":
                raise ConnectionError
        self.robot.line(r"the TLS handshake failed: self-signed certificate")
        learns("unknown ca", "peers", f"wss://127.0.0.1:{self.port}", "--ca", self.at("r", "ca.pem"),
               "--cert", self.at("eve.pem")).expect(says="unknown ca")

    def test_what_cannot_be_certified_is_said_and_changes_nothing(self):
        before = self.text("r", "rowe.toml")

        def refused(*arguments, says, code=1):
            self.rowe("token", *arguments, "--dir", "r", code=code, says=says)
            self.assertEqual(self.text("r", "rowe.toml"), before)
        refused("add", "anna", "pilot", "--certificate", "a.pem", says="there are observer")
        refused("add", "anna", "driver", "--certificate", "none/a.pem", says="none/a.pem cannot be made")
        refused("add", "anna", "driver", "--certificate", "r/ca.pem",
                says="r/ca.pem is there already: choose another name, or remove it first")
        refused("add", "driver", "driver", "--certificate", "a.pem", says="'driver' is there already")
        refused("add", "anna", "driver", "--certificate", "a.pem", "--in-url", says="makes no token", code=2)
        refused("remove", "driver", "--certificate", "a.pem", says="are for `add`", code=2)
        os.remove(self.at("r", "ca-key.pem"))
        refused("add", "anna", "driver", "--certificate", "a.pem", says="root's key was not kept")
        self.assertFalse(os.path.exists(self.at("a.pem")))

    def test_a_full_disk_leaves_no_certificate_of_nobody(self):
        size = 8192  # enough for the certificate, too little for the settings
        self.write(self.text("r", "rowe.toml") + "# much\n" * size, "r", "rowe.toml")
        before = self.all_in("r")
        self.rowe("token", "add", "arm-1", "driver", "--certificate", "arm.pem", "--dir", "r", code=1,
                  says="rowe.toml cannot be written", **full_after(size))
        self.assertFalse(os.path.exists(self.at("arm.pem")))
        self.assertEqual(self.all_in("r"), before)
        self.certificate("arm-1")

    def test_one_without_client_ca_is_said_by_the_configuration(self):
        self.write(self.text("r", "rowe.toml") + "# no client_ca yet\n", "r", "rowe.toml")
        self.rowe("token", "add", "arm-1", "driver", "--certificate", "arm.pem", "--dir", "r",
                  says='add `client_ca = "ca.pem"` to [tls]')
        self.assertIn("arm-1 driver certificate", self.rowe("token", "list", "--dir", "r").stdout)
        told = self.rowe("config", "check", "r/rowe.toml", code=2)
        self.assertIn("identity `arm-1` has only a certificate, and clients are not asked for one",
                      "\n".join(told.stdout + told.stderr))


if __name__ == "__main__":
    unittest.main()

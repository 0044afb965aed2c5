# SPDX-License-Identifier: Apache-2.0
"""A robot that was set up for a network, served under TLS, and those who connect to it.

    with robot() as bot, bot.serving() as serving:
        with bot.peer(serving, "driver") as p: ...

All that is sent is numbered, so that a test can say of each message what became of it."""
import contextlib
import os
import pathlib
import re
import ssl
import tempfile
import time

import program
import websocket

topic = "/numbers"
# Of a message to one subscriber: why it did not come, by the hub's own counters.
drops = ("expired", "outbox_full", "evicted", "no_slot", "over_rate", "lost_with_peer")


roles = ("observer", "driver", "supervisor", "peer")


def tokens_of(ended):
    """The tokens that a run of `rowe setup` printed, by role."""
    found = (re.match(rf"({'|'.join(roles)}) +([\w-]{{43}})$", line) for line in ended.stdout)
    return {one[1]: one[2] for one in found if one}


def content_of(folder):
    """What each of its files holds."""
    return {path.name: path.read_bytes() for path in pathlib.Path(folder).iterdir()}


class robot:
    """Its folder is deleted with it."""

    def __init__(self, *options):
        self.top = tempfile.TemporaryDirectory()
        self.folder = os.path.join(self.top.name, "bot")
        self.file, self.ca = os.path.join(self.folder, "rowe.toml"), os.path.join(self.folder, "ca.pem")
        self.tokens = tokens_of(program.run("setup", "--name", "bot", "--dir", self.folder, "--keep-ca",
                                            *options, code=0))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.top.cleanup()

    def at(self, name):
        return os.path.join(self.folder, name)

    def text(self, name):
        return pathlib.Path(self.at(name)).read_text(encoding="ascii").strip()

    def renew(self, *options, **more):
        """Its certificate; returns the new one, as PEM."""
        program.run("setup", "--renew", "--dir", self.folder, *options, code=0, **more)
        return self.text("certificate.pem")

    def serving(self, *options, address="127.0.0.1", **more):
        return program.hub("--config", self.file, "--address", address, *options, **more)

    def trust(self):
        """What a client of its own root trusts."""
        return ssl.create_default_context(cafile=self.ca)

    def who(self, role):
        """The environment of a program that is to connect as that, or with a token that nobody has."""
        return {"ROWE_CA": self.ca, "ROWE_TOKEN": self.tokens.get(role, role)}

    def peer(self, serving, role, path="/"):
        return websocket.peer(serving.port, serving.host, path, secure=self.trust(),
                              headers={"Authorization": f"Bearer {self.tokens[role]}"})

    def get(self, serving, path, role="observer", more=None):
        """Status, headers, body; `more` are further headers of the request."""
        return websocket.get(serving.port, path, host=serving.host, secure=self.trust(),
                             headers={"Authorization": f"Bearer {self.tokens[role]}", **(more or {})})

    def subscriber(self, serving, role="observer"):
        p = self.peer(serving, role)
        p.subscribe(topic)
        return p

    def stop(self, serving, role="observer"):
        """Stops it, on the path that is kept for that; returns when it has said that it stands."""
        with self.peer(serving, role, "/rowe/stop") as p:
            answer = p.call("/rowe/stop")
        assert (answer["id"], answer["result"]) == ("now", True), answer
        return answer["values"]

    def counts(self, serving, role="supervisor"):
        """Its counters so far, from /metrics, by their names in the library; of those that have one, the name
        and the reason."""
        status, _, body = self.get(serving, "/metrics", role)
        assert status == 200, body
        found = re.findall(r'(?m)^rowe_(\w+)_total(?:\{reason="(\w+)"\})? (\d+)$', body.decode())
        return {f"{name} {reason}".strip(): int(value) for name, reason, value in found}


def until(condition):
    """Returns when it holds: it is asked again and again, so it does something itself."""
    end = time.monotonic() + program.timeout
    while not condition():
        assert time.monotonic() < end, f"not within {program.timeout} s"


def shown(serving):
    """The certificate that a newcomer is shown, as PEM."""
    return ssl.get_server_certificate((serving.host, serving.port)).strip()


def publish(p, numbers):
    for number in numbers:
        p.send({"op": "publish", "topic": topic, "msg": {"n": number}})


def round_trip(p):
    """Returns when the hub has read all that `p` sent; any number of times, where websocket.settle() asks for
    refusals, of which there are only so many a second."""
    p.send_frame(websocket.PING, b"read?")
    while True:
        _, opcode, payload = p.receive_frame()
        if opcode == websocket.PING:
            p.send_frame(websocket.PONG, payload)
        elif (opcode, payload) == (websocket.PONG, b"read?"):
            return


def numbers_until(p, last):
    """The numbers that come, up to `last`."""
    got = []
    while not got or got[-1] != last:
        got.append(p.receive_until(lambda m: m.get("op") == "publish")["msg"]["n"])
    return got


def dropped(counts):
    return sum(counts[name] for name in drops)


@contextlib.contextmanager
def restored(path):
    """A file whose content and mode are as before, at the end."""
    with open(path, "rb") as file:
        content = file.read()
    mode = os.stat(path).st_mode & 0o7777
    try:
        yield content
    finally:
        replace(path, content, mode)


def replace(path, content, mode=0o600):
    """As a program does that lets nobody see half of it."""
    descriptor = os.open(path + ".next", os.O_WRONLY | os.O_CREAT | os.O_TRUNC, mode)
    with open(descriptor, "wb") as file:
        file.write(content)
    os.rename(path + ".next", path)

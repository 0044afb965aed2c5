# SPDX-License-Identifier: Apache-2.0
"""What the fakes that listen have in common: a port of this host, a thread for each connection, and a diary
that tests wait on. Nothing here knows a protocol beyond the request's header.

    with some_fake() as fake:          # listens from here on
        ... fake.port ...
        fake.wait(lambda: fake.heard, "a first message")

A fake that fails in one of its own threads fails the test at the end of the `with`.
"""
import socket
import threading
import time

timeout = 60.0  # seconds; the end of every wait


class gone(Exception):
    """The other side closed, or this side was closed."""


class stream:
    """One accepted connection, read by the thread that serves it; any thread may send."""

    def __init__(self, accepted):
        accepted.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.socket = accepted
        self.buffer = b""
        self.sending = threading.Lock()

    def exactly(self, count):
        while len(self.buffer) < count:
            self.fill()
        data, self.buffer = self.buffer[:count], self.buffer[count:]
        return data

    def until(self, end):
        while end not in self.buffer:
            self.fill()
        data, self.buffer = self.buffer.split(end, 1)
        return data

    def fill(self):
        try:
            more = self.socket.recv(65536)
        except OSError as error:
            raise gone from error
        if not more:
            raise gone
        self.buffer += more

    def send(self, data):
        with self.sending:
            try:
                self.socket.sendall(data)
            except OSError as error:
                raise gone from error

    def shut(self):
        """Ends it in good order, from any thread; whoever reads it finds it gone."""
        try:
            self.socket.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass  # the other side was first


class request:
    """The header of an upgrade request."""

    def __init__(self, text):
        first, *lines = text.decode("latin-1").split("\r\n")
        self.method, self.path, self.version = first.split(" ")
        self.fields = {}
        for line in lines:
            name, value = line.split(":", 1)
            self.fields[name.lower()] = value.strip()

    def __getitem__(self, name):
        return self.fields.get(name)

    @property
    def offers(self):
        return [one.strip() for one in (self["sec-websocket-protocol"] or "").split(",") if one.strip()]


def answer(status, fields):
    lines = "".join(f"{name}: {value}\r\n" for name, value in fields)
    return f"HTTP/1.1 {status}\r\n{lines}\r\n".encode()


class server:
    """Listens; `serve(stream)` of the fake runs in a thread of its own for each connection."""

    def __init__(self, port=0):
        self.changed = threading.Condition()
        self.requests = []  # every one that was upgraded or refused
        self.streams = []
        self.threads = []
        self.failures = []
        self.closing = False
        self.listener = socket.create_server(("127.0.0.1", port))
        self.port = self.listener.getsockname()[1]

    def __enter__(self):
        self.start(self.accept)
        return self

    def __exit__(self, failure=None, *_):
        self.closing = True
        with socket.socket() as knock:  # a thread that waits in accept() is woken by nothing else
            knock.connect(("127.0.0.1", self.port))
        self.threads[0].join(timeout)
        self.cut()
        for thread in self.threads:
            thread.join(timeout)
        self.listener.close()
        for one in self.streams:
            one.socket.close()
        if failure is None and self.failures:
            raise self.failures[0]

    def start(self, job, *arguments):
        thread = threading.Thread(target=self.guarded, args=(job, *arguments), daemon=True)
        self.threads.append(thread)
        thread.start()

    def guarded(self, job, *arguments):
        try:
            job(*arguments)
        except gone:
            pass
        except BaseException as error:  # pylint: disable=broad-except
            self.failures.append(error)
            for one in arguments:
                one.shut()

    def accept(self):
        while True:
            accepted, _ = self.listener.accept()
            if self.closing:
                accepted.close()
                return
            one = stream(accepted)
            self.streams.append(one)
            self.start(self.serve, one)

    def serve(self, one):
        raise NotImplementedError

    def cut(self):
        """Ends every connection; who wants may connect again."""
        for one in self.streams:
            one.shut()

    def read_request(self, one):
        asked = request(one.until(b"\r\n\r\n"))
        self.note(self.requests, asked)
        return asked

    def note(self, diary, entry):
        with self.changed:
            diary.append(entry)
            self.changed.notify_all()

    def wait(self, condition, what, seconds=timeout):
        """Waits until condition() is true, and returns what it returned."""
        end = time.monotonic() + seconds
        with self.changed:
            while not (found := condition()):
                if self.failures:
                    raise self.failures[0]
                if not self.changed.wait(end - time.monotonic()) and time.monotonic() >= end:
                    raise AssertionError(f"{what} did not come")
            return found

# SPDX-License-Identifier: Apache-2.0
"""The programs under test, their handshakes, and a watchdog over all of it."""
import atexit
import base64
import contextlib
import faulthandler
import functools
import hashlib
import os
import queue
import re
import select
import shutil
import signal
import socket
import ssl
import struct
import subprocess
import tempfile
import threading
import time
import traceback

import frames

ROWE = os.environ["ROWE_BIN"]
ECHO = os.environ["ROWE_TRANSPORT_ECHO"]
timeout = 60.0  # seconds a socket or a program may take; far above what anything here does
GUID = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"

running = set()  # processes that must not outlive this one


def made_certificates():
    """A folder with ca.pem, certificate.pem and key.pem, where connections are to be by TLS; else None."""
    maker = os.environ.get("ROWE_MAKE_CERTIFICATES")
    if not maker:
        return None
    folder = tempfile.mkdtemp(prefix="rowe-certificates-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    subprocess.run([maker, folder], check=True)
    return folder


TLS = made_certificates()
WS, HTTP = ("wss", "https") if TLS else ("ws", "http")


def give_up():
    """Whatever hangs is shown and ended before ctest's own time is over."""
    faulthandler.dump_traceback(all_threads=True)
    for process in list(running):
        process.kill()
    os._exit(1)


watchdog = threading.Timer(540, give_up)
watchdog.daemon = True
watchdog.start()


def within(seconds):
    """A test with which the server must not be kept waiting: tried again where it took longer than `seconds`,
    what the server bears, and skipped where it always does."""
    def decorated(test):
        @functools.wraps(test)
        def attempts(self, *arguments):
            for _ in range(4):
                begin = time.monotonic()
                try:
                    return test(self, *arguments)
                except Exception as failure:
                    if time.monotonic() - begin < seconds or "Sanitizer" in str(failure):
                        raise
            return self.skipTest(f"this machine is too slow to be done before {seconds} s are over")
        return attempts
    return decorated


class program:
    """A program that runs until its `with` is left; what it says is kept."""

    ends_with = (0,)  # SIGTERM

    def __init__(self, *command):
        environment = {key: value for key, value in os.environ.items() if key != "ROWE_URL"}
        if TLS:
            environment["ROWE_CA"] = f"{TLS}/ca.pem"
        self.process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, env=environment)
        running.add(self.process)
        self.output, self.errors = queue.Queue(), []
        self.readers = [threading.Thread(target=self.read_output, daemon=True),
                        threading.Thread(target=self.read_errors, daemon=True)]
        for reader in self.readers:
            reader.start()

    def read_output(self):
        for line in self.process.stdout:
            self.output.put(line.decode(errors="replace").rstrip("\n"))
        self.output.put(None)

    def read_errors(self):
        for line in self.process.stderr:
            self.errors.append(line.decode(errors="replace").rstrip("\n"))

    def line(self):
        """The next line of its output."""
        said = self.output.get(timeout=timeout)
        if said is None:
            raise AssertionError(f"it ended: {self.errors}")
        return said

    def wait(self):
        """Waits for its end; returns the exit code."""
        code = self.process.wait(timeout=timeout)
        for reader in self.readers:
            reader.join()
        return code

    def resident_bytes(self):
        with open(f"/proc/{self.process.pid}/status", encoding="ascii") as status:
            return int(re.search(r"VmRSS:\s+(\d+) kB", status.read())[1]) * 1024

    def __enter__(self):
        return self

    def __exit__(self, failure, *_):
        ran = self.process.poll() is None
        if ran:
            self.process.send_signal(signal.SIGTERM)
        try:
            code = self.wait()
        finally:
            self.process.kill()
            running.discard(self.process)
            self.process.stdout.close()
            self.process.stderr.close()
        found = [line for line in self.errors if re.search(r"Sanitizer|runtime error:", line)]
        if found or (failure is None and ran and code not in self.ends_with):
            raise AssertionError(f"exit code {code}: " + "\n".join(self.errors))


def secured(s):
    """The socket behind a TLS handshake with a server of ours."""
    context = ssl.create_default_context(cafile=f"{TLS}/ca.pem")
    return context.wrap_socket(s, server_hostname="127.0.0.1")


def half_close(s):
    """Ends our direction. Python's TLS would forget the other one, so under TLS this is a cut."""
    socket.socket.shutdown(s, socket.SHUT_WR)


class server(program):
    """`transport_echo --port` or `rowe serve`, ready for connections."""

    def __init__(self, kind, *options):
        self.kind = kind
        command = [ECHO, "--port", "0"] if kind == "echo" else [ROWE, "serve", "--port", "0"]
        if TLS and "--port" in command:
            command += ["--certificate", f"{TLS}/certificate.pem", "--key", f"{TLS}/key.pem"]
        super().__init__(*command, *options)
        self.port = int(re.search(r"(?:port |127\.0\.0\.1:)(\d+)", self.line())[1])

    def dial(self):
        """A bare TCP connection to it."""
        s = socket.create_connection(("127.0.0.1", self.port), timeout=timeout)
        s.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return secured(s) if TLS else s

    def connect(self, behind=b"", target="/", fields=()):
        """A connection behind its handshake; `behind` goes out with the request; `fields` are more of it."""
        s = self.dial()
        s.sendall(upgrade(self.port, *fields, target=target) + behind)
        status, answered, rest = read_answer(s)
        if status != 101 or answered.get("sec-websocket-accept") != accept_of(KEY):
            s.close()
            raise frames.wrong(f"4.2.2: answered {status} {answered}")
        return frames.stream(s, peer_masks=False, begin=rest)


def servers():
    """One of each kind, one after the other."""
    for kind in ("echo", "hub"):
        with server(kind) as serving:
            yield serving


# Each text that is refused is answered, however many there are.
unlimited = ("--limit", "refusals_per_second_max=0", "--limit", "messages_per_second_max=0")
KEY = base64.b64encode(bytes(range(16))).decode()


def accept_of(key):
    return base64.b64encode(hashlib.sha1(key.encode() + GUID).digest()).decode()


def upgrade(port, *more, method="GET", target="/", version="HTTP/1.1", **changes):
    """An upgrade request; a field set to None is left out; `more` are whole lines behind the others."""
    fields = {"Host": f"127.0.0.1:{port}", "Upgrade": "websocket", "Connection": "Upgrade",
              "Sec-WebSocket-Key": KEY, "Sec-WebSocket-Version": "13"}
    fields.update({name.replace("_", "-"): value for name, value in changes.items()})
    lines = [f"{method} {target} {version}"]
    lines += [f"{name}: {value}" for name, value in fields.items() if value is not None]
    return "\r\n".join([*lines, *more, "", ""]).encode("latin-1")


def read_header(s):
    """Everything up to the empty line, and what came behind it; None when the stream ended before."""
    data = b""
    while b"\r\n\r\n" not in data:
        try:
            piece = s.recv(65536)
        except ConnectionResetError:
            piece = b""
        if not piece:
            return None, data
        data += piece
    header, _, rest = data.partition(b"\r\n\r\n")
    return header.decode("latin-1").split("\r\n"), rest


def fields_of(lines):
    return {name.strip().lower(): value.strip()
            for name, _, value in (line.partition(":") for line in lines)}


def read_answer(s):
    """(status, fields, what came behind the header); the status is None when there was no answer."""
    lines, rest = read_header(s)
    if lines is None:
        return None, {}, rest
    return int(lines[0].split()[1]), fields_of(lines[1:]), rest


def reset(s):
    """Lets closing send a reset."""
    s.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))


def pause(s, seconds=0.02):
    """Time passes, unless something comes; what comes stays where it is."""
    select.select([s], [], [], seconds)


class listener:
    """A place that clients under test connect to."""

    def __init__(self):
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.socket.settimeout(timeout)
        self.port = self.socket.getsockname()[1]
        self.url = f"{WS}://127.0.0.1:{self.port}/"

    def accept(self):
        """The next client and its request, as lines."""
        s, _ = self.socket.accept()
        s.settimeout(timeout)
        s.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if TLS:
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            context.load_cert_chain(f"{TLS}/certificate.pem", f"{TLS}/key.pem")
            s = context.wrap_socket(s, server_side=True)
        request, rest = read_header(s)
        if rest:
            raise frames.wrong("4.1: the client did not wait for the answer")
        return s, request

    def open(self, behind=b""):
        """The next client, its handshake answered; `behind` goes out with the answer."""
        s, request = self.accept()
        s.sendall(switching(request) + behind)
        return frames.stream(s, peer_masks=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()


def switching(request, *more, **changes):
    """The answer 101 to a request; fields as in upgrade()."""
    fields = {"Upgrade": "websocket", "Connection": "Upgrade",
              "Sec-WebSocket-Accept": accept_of(fields_of(request[1:])["sec-websocket-key"])}
    fields.update({name.replace("_", "-"): value for name, value in changes.items()})
    lines = [f"{name}: {value}" for name, value in fields.items() if value is not None]
    return "\r\n".join(["HTTP/1.1 101 Switching Protocols", *lines, *more, "", ""]).encode("latin-1")


def in_parallel(jobs, threads, using=contextlib.nullcontext):
    """Calls each of (name, function) with what `using()` gives its thread; fails with all that failed. A
    thread on which something failed gets a new one, unless that was what failed."""
    waiting, failed = queue.SimpleQueue(), []
    for job in jobs:
        waiting.put(job)

    def work():
        name = None
        while name != "set-up":
            try:
                job = waiting.get_nowait()  # nothing is set up for nothing
            except queue.Empty:
                return
            name = "set-up"
            try:
                with using() as tool, contextlib.suppress(queue.Empty):
                    while True:
                        name, act = job
                        act(tool)
                        job = waiting.get_nowait()
            except BaseException as failure:  # said below
                told = "".join(traceback.format_exception(failure)) if len(failed) < 5 else repr(failure)
                failed.append(f"{name}: {told}")

    workers = [threading.Thread(target=work) for _ in range(threads)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    if failed:
        raise AssertionError(f"{len(failed)} failed:\n" + "\n".join(failed))

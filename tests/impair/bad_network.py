# SPDX-License-Identifier: Apache-2.0
"""For scripts that need a bad network: tests/impair/impair as a process, and programs on both sides of it."""
import os
import subprocess
import sys
import threading

import link

here = os.path.dirname(os.path.abspath(__file__))


def why_not():
    """Why there can be no network here; empty where there can be one. An ordinary user's script starts again
    in a user namespace of its own, if it may."""
    try:
        link.permitted()
        return ""
    except link.cannot as reason:
        if "ROWE_OWN_USER_NAMESPACE" in os.environ:
            return str(reason)
        try:
            tried = subprocess.run([*link.own_user_namespace, "true"], check=False, capture_output=True)
        except FileNotFoundError:
            return str(reason)
        if tried.returncode != 0:
            return str(reason)
    environment = {**os.environ, "ROWE_OWN_USER_NAMESPACE": "1"}
    os.execvpe(link.own_user_namespace[0], [*link.own_user_namespace, sys.executable, *sys.argv], environment)


class network:
    """impair, while a `with` lasts; and the processes started inside, which end with it."""

    made = 0  # in this process

    def __init__(self, *settings, seed=1):
        network.made += 1
        self.name, self.processes = f"rowe{os.getpid()}.{network.made}", []
        self.process = subprocess.Popen([sys.executable, os.path.join(here, "impair"), "--name", self.name,
                                         "--seed", str(seed), *settings],
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.first = self.process.stdout.readline()

    def __enter__(self):
        if not self.first:
            self.process.communicate()
            raise RuntimeError(f"impair ended with {self.process.returncode}")
        return self

    def __exit__(self, *_):
        for process in self.processes:
            process.kill()
            process.communicate()
        self.process.communicate()  # ends with its input

    def namespace(self, side):
        return f"{self.name}-{side}"

    def tell(self, line):
        """Settings, `show` or `counts`; returns the answer, which comes when it is done."""
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        return self.process.stdout.readline().strip()

    def start(self, side, *command):
        """A process inside, its input and output pipes of text."""
        process = subprocess.Popen(["ip", "netns", "exec", self.namespace(side), *command],
                                   stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.processes.append(process)
        return process

    def call(self, side, function, *arguments):
        """What a function of this script returns when it is called inside, on a thread of its own: a socket
        that it opens stays on that side."""
        result = []

        def work():
            with open(f"/run/netns/{self.namespace(side)}", "rb") as there:
                link.enter(there.fileno())
            result.append(function(*arguments))

        worker = threading.Thread(target=work)
        worker.start()
        worker.join()
        return result[0]

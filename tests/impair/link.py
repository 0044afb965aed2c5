# SPDX-License-Identifier: Apache-2.0
"""Two network namespaces, `a` and `b`, each with a TUN device, and packets carried between them.

What one side's kernel sends is read from its device, held for as long as its direction says, and written into
the other device. One thread; needs CAP_SYS_ADMIN and CAP_NET_ADMIN, of the machine or of a user namespace.
"""
import ctypes
import fcntl
import heapq
import os
import select
import shlex
import shutil
import struct
import subprocess
import time

import direction

sides = ("a", "b")
address = {"a": "10.98.76.1", "b": "10.98.76.2"}
device = "impaired"
packet_bytes_max = 65536
burst_max = 64  # packets from one side before the other has its turn


class cannot(Exception):
    """The machine does not permit it; says why, and what would help."""


def _ip(*arguments):
    run = subprocess.run(["ip", *arguments], stdin=subprocess.DEVNULL, capture_output=True, text=True)
    if run.returncode != 0:
        raise cannot(f"ip {' '.join(arguments)}: {run.stderr.strip() or run.returncode}")


# Runs a command in a user namespace, where everybody may do what is done here.
own_user_namespace = ("unshare", "-Urmn", "sh", "-c",
                      'mount -t tmpfs none /run && ip link set lo up && exec "$0" "$@"')
clone_newnet, clone_newns = 0x40000000, 0x20000
ms_rec, ms_slave = 0x4000, 0x80000
_libc = ctypes.CDLL(None, use_errno=True)


def permitted():
    """Raises `cannot` when the machine does not permit it. Tries in a child, so nothing is left behind."""
    if shutil.which("ip") is None:
        raise cannot("there is no command ip (package iproute2)")
    child = os.fork()
    if child == 0:
        if _libc.unshare(clone_newnet | clone_newns) != 0:
            os._exit(1)
        os._exit(2 if _libc.mount(b"none", b"/", None, ms_rec | ms_slave, None) != 0 else 0)
    ended = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if ended == 2:
        raise cannot("may not change how / is mounted, as `ip -n` does: in a chroot, / is no mount point")
    if ended != 0:
        raise cannot("may not create network namespaces (CAP_SYS_ADMIN and CAP_NET_ADMIN, or a user "
                     f"namespace: {shlex.join(own_user_namespace)} bash)")
    try:
        os.close(os.open("/dev/net/tun", os.O_RDWR))
    except OSError as failure:
        raise cannot(f"may not open /dev/net/tun: {failure.strerror}") from None


class link:
    """Use it as `with link(...)`: leaving it removes what it made, also when making it failed half-way."""

    def __init__(self, name, seed):
        self.namespace = {side: f"{name}-{side}" for side in sides}
        # By the side that sends. A seed for each: what one direction carries must not change the other.
        self.directions = {side: direction.direction(f"{seed} {side}") for side in sides}
        self.tun = {}
        self.made = []
        self.held = []  # a heap of (when, number, to, packet)
        self.number = 0

    def __enter__(self):
        permitted()
        try:
            for side in sides:
                self._make(side)
        except BaseException:
            self.__exit__()
            raise
        return self

    def _make(self, side):
        name = self.namespace[side]
        if os.path.exists(f"/run/netns/{name}"):
            raise cannot(f"namespace {name} exists: of another run, or left by one that was killed "
                         f"(ip netns delete {name})")
        self.made.append(name)  # before it is there: a signal may come in between
        _ip("netns", "add", name)
        self.tun[side] = _open_tun(name)
        other = address["b" if side == "a" else "a"]
        _ip("-n", name, "link", "set", "lo", "up")
        _ip("-n", name, "address", "add", address[side], "peer", other, "dev", device)
        _ip("-n", name, "link", "set", device, "up")

    def __exit__(self, *_):
        for descriptor in self.tun.values():
            os.close(descriptor)
        self.tun.clear()
        for name in self.made:
            if os.path.exists(f"/run/netns/{name}"):
                _ip("netns", "delete", name)
        self.made.clear()

    def carry(self, others=()):
        """Carries packets until one of the descriptors `others` has something to read; returns which."""
        descriptors = [*self.tun.values(), *others]
        while True:
            wait = None
            if self.held:
                wait = max(0.0, (self.held[0][0] - time.monotonic_ns()) / direction.ns_per_second)
            ready, _, _ = select.select(descriptors, [], [], wait)
            for side in sides:
                if self.tun[side] in ready:
                    self._take(side)
            self._let_go()
            for_others = [one for one in ready if one in others]
            if for_others:
                return for_others

    def _take(self, side):
        to = self.tun["b" if side == "a" else "a"]
        for _ in range(burst_max):
            try:
                packet = os.read(self.tun[side], packet_bytes_max)
            except BlockingIOError:
                return
            for when in self.directions[side].take(time.monotonic_ns(), len(packet)):
                self.number += 1
                heapq.heappush(self.held, (when, self.number, to, packet))

    def _let_go(self):
        now = time.monotonic_ns()
        while self.held and self.held[0][0] <= now:
            _, _, to, packet = heapq.heappop(self.held)
            try:
                os.write(to, packet)
            except OSError:
                pass  # its kernel has no room, or the device is down: packets get lost there, too


def _open_tun(name):
    """A TUN device in a namespace: one has to be in it to open the device, and may leave it then."""
    with open("/proc/self/ns/net", "rb") as home, open(f"/run/netns/{name}", "rb") as there:
        enter(there.fileno())
        try:
            return _attach()
        finally:
            enter(home.fileno())


def enter(namespace):
    if _libc.setns(namespace, clone_newnet) != 0:
        raise cannot(f"setns: {os.strerror(ctypes.get_errno())}")


def _attach():
    with open("/proc/sys/net/ipv6/conf/default/disable_ipv6", "w", encoding="ascii") as setting:
        setting.write("1")  # it would send packets that nobody asked for
    descriptor = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
    set_interface, tun_without_header = 0x400454ca, 0x1001
    try:
        fcntl.ioctl(descriptor, set_interface, struct.pack("16sH22x", device.encode(), tun_without_header))
    except OSError as failure:
        os.close(descriptor)
        raise cannot(f"may not make a TUN device: {failure.strerror}") from None
    return descriptor

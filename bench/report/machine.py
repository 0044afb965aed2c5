# SPDX-License-Identifier: Apache-2.0
"""What machine it is, as the page says on top; nothing in here is particular to one architecture."""
import json
import os
import re
import subprocess
import time

unknown = "unknown"


def first_line(path):
    try:
        with open(path, encoding="utf-8", errors="replace") as file:
            return file.readline().strip("\0\n ") or unknown
    except OSError:
        return unknown


def said(*command, cwd=None):
    """What a command prints; nothing if it is not there or fails."""
    try:
        return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=30, check=True,
                              env={**os.environ, "LC_ALL": "C"}).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return ""


def processor():
    """The board, where there is a device tree, and the models of its cores."""
    models = dict.fromkeys(re.findall(r"(?m)^\s*Model name:\s*(\S.*)", said("lscpu")))
    board = first_line("/proc/device-tree/model")
    parts = ([board] if board != unknown else []) + [model for model in models if model != "-"]
    return ", ".join(parts) or os.uname().machine


def system():
    try:
        with open("/etc/os-release", encoding="utf-8") as file:
            return re.search(r'(?m)^PRETTY_NAME="?([^"\n]*)', file.read())[1]
    except (OSError, TypeError):
        return unknown


def compiler(programs):
    """That which built the programs of this folder: its build tree remembers."""
    try:
        with open(os.path.join(programs, "..", "CMakeCache.txt"), encoding="utf-8") as file:
            cache = file.read()
        path = re.search(r"(?m)^CMAKE_CXX_COMPILER:\w+=(.*)", cache)[1]
    except (OSError, TypeError):
        return unknown
    return said(path, "--version").partition("\n")[0] or unknown


def commit(folder="."):
    """Of the tree that the folder lies in. With a note if what was built is not what was committed; the
    generated pages do not count."""
    name = said("git", "-C", folder, "rev-parse", "--short=12", "HEAD")
    if not name:
        return unknown
    changed = said("git", "-C", folder, "status", "--porcelain", "--", ":/", ":!/docs/benchmarks.md",
                   ":!/docs/benchmarks-compared.md", ":!/docs/benchmarks")
    return name + (" with changes" if changed else "")


def load():
    return " ".join(first_line("/proc/loadavg").split()[:2])


def today():
    return time.strftime("%Y-%m-%d", time.gmtime())


def facts(programs):
    """What is on top of the page, in this order."""
    return {
        "processor": processor(),
        "cores": str(len(os.sched_getaffinity(0))),
        "kernel": os.uname().release,
        "system": system(),
        "clock source": first_line("/sys/devices/system/clocksource/clocksource0/current_clocksource"),
        "governor": first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor"),
        "compiler": compiler(programs),
        "date": today(),
        "commit": commit(),
        "load before": load(),
    }


compared = ("libboost-dev", "libconcurrentqueue-dev", "libjson-c-dev", "libreaderwriterqueue-dev",
            "libsimdjson-dev", "libwebsocketpp-dev", "libwebsockets-dev", "nlohmann-json3-dev",
            "python3-websockets", "rapidjson-dev")


def versions():
    """Of what is compared and is there, [(name, version)]."""
    found = [(name.removesuffix("-dev"), said("dpkg-query", "-W", "-f=${Version}", name))
             for name in compared]
    try:
        installed = os.path.join("bench/peers/ws", "node_modules")
        with open(os.path.join(installed, "ws", "package.json"), encoding="utf-8") as file:
            found.append(("ws", json.load(file)["version"] + " on node " + said("node", "--version")))
    except OSError:
        pass
    return [(name, version) for name, version in found if version]

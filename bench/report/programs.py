# SPDX-License-Identifier: Apache-2.0
"""The programs of tools/benchmark, in the order of the page.

A program is named without its `bench_`. What it is like (`kind`):

    benchmark   on Google Benchmark, or a script which takes --benchmark_out=FILE and writes the same JSON
    callgrind   each function of namespace steps is called a thousand times; instructions of one call
    text        the page shows what it prints as it is

`source` is the file in bench/ whose opening comment says what is measured: bench/README.md is made of these.
`starts_others`: it starts the servers of bench/peers.
`command` is what is run; {bin} stands for the folder of the programs.
"""
import dataclasses


@dataclasses.dataclass(frozen=True)
class program:
    name: str
    title: str
    kind: str = "benchmark"
    source: str = ""
    command: tuple = ()
    takes_rounds: bool = True
    starts_others: bool = False  # servers to compare with

    def __post_init__(self):
        if not self.source:
            object.__setattr__(self, "source", self.name + ".cpp")
        if not self.command:
            object.__setattr__(self, "command", ("{bin}/bench_" + self.name,))


programs = (
    program("hand_over", "Hand-over between threads"),
    program("publish", "Publish"),
    program("instructions", "Instructions of a call", kind="callgrind", takes_rounds=False),
    program("json_write", "JSON, written"),
    program("json_read", "JSON, read"),
    program("round_trip", "Round trip", starts_others=True),
    program("throughput", "Throughput", starts_others=True),
    program("fan_out", "Fan-out", starts_others=True),
    program("arrivals", "Publish to arrival"),
    program("invoke", "Invoke"),
    program("sending", "Throughput, one peer"),
    program("tls", "TLS"),
    program("expiry", "Expiry"),
    program("scale", "Scale"),
    program("idle_connections", "Idle connections"),
    program("idle_policies", "Idle policies"),
    program("phase", "In phase with a loop"),
    program("urgent", "What is urgent, behind a slow reader"),
    program("urgent_clients", "What is urgent, to ws and to Chromium", kind="text",
            source="urgent_clients/run",
            command=("bench/urgent_clients/run", "{bin}/bench_urgent_servers", "--rounds=1", "--spend=30",
                     "--messages=50"),
            takes_rounds=False),
    program("every_client", "Nine clients at 1 kHz"),
    program("maps", "Maps beside a stream and the stop"),
    program("requests", "What requests cost, and what they do to the stop"),
    program("stop_under_flood", "The stop under a flood"),
    program("stop_under_handshakes", "The stop under TLS handshakes"),
    program("tls_load", "A thousand clients under TLS"),
    program("standstill", "Standstill when a driver is gone", kind="text", source="standstill.cpp",
            command=("{bin}/bench_standstill", "--trials=2000"), takes_rounds=False),
    program("record", "What a recording costs", kind="text",
            command=("{bin}/bench_record", "/tmp"), takes_rounds=True),
    program("stop_on_silence", "The stop when a guard falls silent", kind="text", source="stop_on_silence",
            command=("bench/stop_on_silence", "{bin}/bench_stop_robot", "--runs", "5"), takes_rounds=False),
)


def named(name):
    """The program of that name, with or without `bench_`; None if there is none."""
    short = name.removeprefix("bench_")
    return next((one for one in programs if one.name == short), None)

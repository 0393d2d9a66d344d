#!/usr/bin/env python3
"""Costs of single operations: the figures in docs/SECURITY.md and docs/architecture.md.

    benchmarks/costs.py [--only hook,owner,definition] [--connections 3000]

`hook`: processor time of an interpreter start, with and without the import hook. `owner`: finding the
user of a connection in /proc/net/tcp. `definition`: time and memory of the largest message definitions that
a peer may send. Only pipros is measured: genuine ROS has none of these.
"""

from __future__ import annotations

import argparse
import os
import resource
import socket
import statistics
import subprocess
import sys
import time
from contextlib import ExitStack

from pipros.basics.limits import Limits
from pipros.msg.dynamic import message_classes_from_text
from pipros.net.this_machine import Caller

DEFINITIONS = {
    "strings": lambda count: "\n".join(f"string f{number}" for number in range(count)),
    "numbers": lambda count: "\n".join(f"float64 f{number}" for number in range(count)),
    "string arrays": lambda count: "\n".join(f"string[] f{number}" for number in range(count)),
    "times": lambda count: "\n".join(f"time f{number}" for number in range(count)),
    "messages": lambda count: (
        "\n".join(f"a/B f{number}" for number in range(count // 12))
        + f"\n{'=' * 80}\nMSG: a/B\n"
        + "\n".join(f"string f{number}" for number in range(9))
    ),
}


def processor_s(command: list[str], **variables: str) -> float:
    """Return the processor time of a command."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, env={**os.environ, **variables}, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measure_hook() -> None:
    command = [sys.executable, "-c", "pass"]
    variables = ({}, {"PIPROS_NO_IMPORT_HOOK": "1"})
    with_hook, without = [], []
    for _ in range(40):
        with_hook.append(processor_s(command, **variables[0]))
        without.append(processor_s(command, **variables[1]))
    print(f"interpreter start with the import hook     {statistics.median(with_hook) * 1000:6.1f} ms")
    print(f"interpreter start, PIPROS_NO_IMPORT_HOOK=1 {statistics.median(without) * 1000:6.1f} ms")


def measure_owner(connections: int) -> None:
    with ExitStack() as stack:
        server = stack.enter_context(socket.create_server(("127.0.0.1", 0), backlog=1024))
        for count in (1, connections):
            pairs = 0
            while pairs < count:
                client = stack.enter_context(socket.create_connection(server.getsockname()))
                accepted = stack.enter_context(server.accept()[0])
                pairs += 1
            caller = Caller.from_names(client.getsockname(), accepted.getsockname())
            times = []
            for _ in range(5):
                start = time.perf_counter()
                assert caller.user_id() == os.getuid()
                times.append(time.perf_counter() - start)
            print(
                f"user of one of {count:5} connections            {statistics.median(times) * 1000:6.1f} ms"
            )


def measure_definitions() -> None:
    """Run each in its own process, and measure the largest size."""
    for kind in DEFINITIONS:
        print(f"definition of {kind:15}", end="", flush=True)
        subprocess.run([sys.executable, __file__, "--one-definition", kind], check=True)


def compile_definition(kind: str) -> None:
    limit = Limits().definition_fields
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start = time.process_time()
    message_classes_from_text("a/A", DEFINITIONS[kind](limit - 20))
    took = time.process_time() - start
    mib = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    print(f"{limit - 20:6} fields {took:6.2f} s {mib:6.0f} MiB")


def main() -> None:
    parser = argparse.ArgumentParser(description="Costs of single operations of pipros.")
    parser.add_argument("--only", default="hook,owner,definition", help="default: %(default)s")
    parser.add_argument("--connections", type=int, default=3000, help="for owner; default: %(default)s")
    parser.add_argument("--one-definition", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one_definition:
        compile_definition(options.one_definition)
        return
    chosen = options.only.split(",")
    if "hook" in chosen:
        measure_hook()
    if "owner" in chosen:
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        wanted = 2 * options.connections + 100
        resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, min(wanted, hard)), hard))
        measure_owner(options.connections)
    if "definition" in chosen:
        measure_definitions()


if __name__ == "__main__":
    main()

"""Rows of measurements and their output, shared by the benchmarks.

Also runs in genuine ROS's Python, so it imports only the standard library.
"""

import argparse
import json
import os
import random
import signal
import socket
import statistics
import sys
import time

#: Variables that make the allocator keep freed memory. Large messages then cause fewer page faults.
TUNED = {"MALLOC_TOP_PAD_": str(64 << 20), "MALLOC_MMAP_THRESHOLD_": str(64 << 20)}

#: The implementations, in the order of the columns. The last one is compared with the others.
WORLDS = ("genuine", "tuned", "roscpp", "pipros over TCP", "pipros")


def heed_interrupts():
    """Restore SIGINT for the programs that a benchmark starts.

    A shell makes its background jobs ignore SIGINT, and their child processes inherit this.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)


def options_of(description, **defaults):
    """Return the options on the command line.

    Args:
        description: the benchmark's docstring, which explains them.
        defaults: the options. A value has the type of its default; those that are False are switches.
    """
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=description, formatter_class=raw)
    for name, default in defaults.items():
        if default is False:
            parser.add_argument("--" + name, action="store_true")
        else:
            parser.add_argument("--" + name, type=type(default), default=default, help="default: %(default)s")
    return parser.parse_args()


class Row:
    """One figure's values, round by round, for each implementation.

    If `best` is true, the best round counts instead of the median. This is for operations that only take
    processor time.
    """

    def __init__(self, label, values, more_is_better=False, best=False):
        self.label, self.values, self.more_is_better, self.best = label, values, more_is_better, best

    def figure(self, world):
        """Return the representative value for all rounds."""
        if self.best:
            return (max if self.more_is_better else min)(self.values[world])
        return statistics.median(self.values[world])

    def ratio(self, world="genuine"):
        """Return the factor by which pipros is better; None if there are not figures for both
        implementations.
        """
        if not self.values.get(world) or not self.values.get("pipros"):
            return None
        return self._ratio(self.figure(world), self.figure("pipros"))

    def spread(self, world="genuine"):
        """Return the smallest and largest ratio in any round."""
        pairs = zip(self.values[world], self.values["pipros"])  # noqa: B905 # Python 3.8
        ratios = [self._ratio(theirs, ours) for theirs, ours in pairs]
        return min(ratios), max(ratios)

    def _ratio(self, theirs, ours):
        better, worse = (ours, theirs) if self.more_is_better else (theirs, ours)
        return better / worse if worse else float("inf")


def as_text(value):
    """Format a figure with three digits, as in 12,345 or 0.0123."""
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"


def markdown(rows, title="", note=None):
    """Return a Markdown table with a column for each implementation that has figures, and a column with
    `note(row)`.
    """
    worlds = [world for world in WORLDS if any(row.values.get(world) for row in rows)]
    heads = ["workload", *worlds]
    others = worlds[:-1]
    for world in others:
        heads += [f"ratio to {world}", "min..max"] if world == "genuine" else [f"to {world}"]
    if note:
        heads.append(title)
    lines = [line(heads), line(["---", *["---:"] * (len(heads) - 1 - bool(note)), *["---"] * bool(note)])]
    for row in rows:
        cells = [row.label]
        cells += [as_text(row.figure(world)) if row.values.get(world) else "" for world in worlds]
        for world in others:
            ratio = row.ratio(world)
            cells.append("" if ratio is None else f"{ratio:.2f} x")
            if world == "genuine":
                cells.append("" if ratio is None else "{:.2f}..{:.2f}".format(*row.spread(world)))
        if note:
            cells.append(note(row))
        lines.append(line(cells))
    return "\n".join(lines)


def line(cells):
    return "| " + " | ".join(cells) + " |"


def write_json(path, rows):
    """Write rows for `script/bench`, which joins the rows from all benchmarks."""
    with open(path, "w") as file:
        json.dump([vars(row) for row in rows], file)


def read_json(path):
    with open(path) as file:
        return [Row(**values) for values in json.load(file)]


class Load:
    """The processor usage of other programs. Child processes count as others until they have ended."""

    def __init__(self):
        self._busy, self._all, self._own = *self._ticks(), self._used()

    def percent(self):
        """Return other programs' processor usage since the last call, as a percentage of all processors."""
        busy, ticks, own = *self._ticks(), self._used()
        others = busy - self._busy - (own - self._own) * os.sysconf("SC_CLK_TCK")
        passed = max(ticks - self._all, 1)
        self._busy, self._all, self._own = busy, ticks, own
        return max(0.0, 100 * others / passed)

    def _ticks(self):
        if not sys.platform.startswith("linux"):
            return 0, 0
        with open("/proc/stat") as file:
            ticks = [int(value) for value in file.readline().split()[1:9]]
        return sum(ticks) - ticks[3] - ticks[4], sum(ticks)

    def _used(self):
        return sum(os.times()[:4])


def free_port():
    """Return a port below those that the system assigns, so that no connection takes it before a server."""
    while True:
        port = random.randrange(20_000, 30_000)  # noqa: S311
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)):
                return port


def wait_for_port(port):
    """Wait until a program listens on a TCP port of loopback, for at most 60 s."""
    end_s = time.monotonic() + 60
    while True:
        try:
            return socket.create_connection(("127.0.0.1", port)).close()
        except OSError:
            if time.monotonic() > end_s:
                raise
            time.sleep(0.002)

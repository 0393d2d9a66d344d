#!/usr/bin/env python3
"""Run all benchmarks one after another, and print their tables as Markdown.

    script/bench [--quick] [--rounds 3] [--seconds 2] [--only client,codec] [--update [FILE]]

Benchmarks without a counterpart in genuine ROS print their own tables. A benchmark during which other
programs used more than 2 % of the processors is repeated up to twice. `--quick` measures some of the rows
once, in less than two minutes. `--update` without FILE needs a commit, which each table that it replaces in
RESULTS.md names; it also updates the tables that documents take from there.
"""

import argparse
import glob
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import time

import figures
from table import Load, heed_interrupts, markdown, read_json

BEGIN, END = "<!-- script/bench begin -->", "<!-- script/bench end -->"
HERE = os.path.dirname(os.path.abspath(__file__))
RESULTS = os.path.join(HERE, "RESULTS.md")
DOCS = os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "..", "..", "docs")
GENUINE = os.path.exists("/usr/lib/python3/dist-packages/rospy")

# The options for each benchmark: for a full run, with {rounds}, {seconds} and {svg}, and for a quick run.
BENCHMARKS = {
    "cost": ("--rounds {rounds} --seconds {seconds}", None),
    "client": ("--rounds {rounds} --seconds {seconds}", "--quick --rounds 1 --seconds 0.7"),
    "master": (
        "--rounds {rounds} --only params,dictionary,registration,together,start_up",
        "--rounds 1 --only params",
    ),
    "startup": ("--rounds {rounds}", "--rounds 1 --only import,roscore"),
    "codec": ("--rounds {rounds}", "--rounds 1 --only String,Imu,Path"),
    "libraries": ("--rounds {rounds} --seconds {seconds}", "--rounds 1 --seconds 0.7 --only tf,filter"),
    "bags": ("--rounds {rounds}", "--rounds 1 --only none,lz4"),
    "scale": ("--rounds {rounds} --seconds {seconds} --svg {svg}", None),
    "bridges": ("--rounds {rounds} --seconds 5", None),
}
NEEDS_GENUINE = ("codec", "bags")
# Benchmarks that print their own tables. `ros2` needs cyclonedds, `data` needs rosbags-dataframe and pandas.
OWN_TABLES = {
    "data": "--rounds {rounds}",
    "navigation_beside_genuine": "",
    "perception": "--seconds 5",
    "wheels": "--rounds {rounds}",
    "fleet": "--seconds 2",
    "ros2": "--rounds {rounds}",
}
ALL = (*BENCHMARKS, *OWN_TABLES)
MAX_LOAD, TRIES = 2, 3  # % of the processors used by others, and how often a benchmark is run to stay below

# The bottleneck of rows, with the starts of their labels. The longest start that fits counts.
BOUNDS = {
    "copies: one into shared memory, one into the message": "Image 1 MB|PointCloud2 4 MB",
    "Python code: some 3 us for each message at the subscriber": "String 16 B",
    "Python code: decoding, and calling the callback": "Imu,",
    "copies, and four thread wake-ups": "round trip 1 MB",
    "four thread wake-ups": "round trip",
    "ten send calls, all in one thread; two processors for eleven processes": "1 to 10 processes",
    "two wake-ups each way; a call to the master for each call unless persistent": "service call",
    "the interpreter lock, which the thread that encodes the map also needs": "requestTopic",
    "one thread for each link": "200 topics",
    "calls to the master, and starting threads": "init_node",
    "importing modules": "import",
    "unregistering with the master": "exit of a node",
    "the interpreter and its modules": "resident memory|master: memory",
    "a genuine node sometimes misses Ctrl-C, and is killed after 20 s": "rosrun talker, exit",
    "stopping /rosout, and ending the interpreter": "roscore, exit|master: exit",
    "stopping the nodes": "roslaunch, exit",
    "the talker's period of 1 s, because the first message is missed": "roslaunch, first message received: s",
    "a sleep of 1 s in the test": "rostest",
    "starting Python, and importing modules": "master: start",
    "reading and writing XML in Python": "master:|nodes,",
    "Python code for each chunk": "bag: open",
    "compression": "bag: write Image 0.9 MB, lz4",
    "decompression": "bag: read Image 0.9 MB, lz4",
    "copying": "bag: write Image|bag: read Image|serialize Image|serialize PointCloud2|deserialize Image|"
    "deserialize PointCloud2|from bytes Image|from bytes PointCloud2|message of 1 MB|message of 8 MB|"
    "Image 100 kB at|Image 1 MB at|PointCloud2 4 MB at",
    "Python code for each message, and compression": "bag:",
    "Python code for each string, array and embedded message": "serialize|buffers",
    "creating objects": "deserialize|from bytes",
    "copies; base64 for JSON, compression for PNG": "rosbridge: an image",
    "encoding in Python, in cbor2 or in pymongo": "rosbridge:",
    "a system call for each message and client": "rosbridge JSON|Foxglove:",
    "Python code and system calls for each message": "message of|String 16 B at|Image 10 kB at",
    "one send call per subscriber, all in one thread": "subscribers,",
    "calls to the master, and connections": "topics,",
    "Python instead of C++": "set_transform|lookup_|can_",
    "decoding transforms": "tf listener",
    "Python code for each message": "TimeSynchronizer|ApproximateTimeSynchronizer",
    "messages in both directions, and thread wake-ups": "send_goal",
}


def bound(row):
    """Return the bottleneck for a row. For most commands, it is the interpreter's start-up."""
    starts = ((start, text) for text, group in BOUNDS.items() for start in group.split("|"))
    fitting = {start: text for start, text in starts if row.label.startswith(start)}
    return fitting[max(fitting, key=len)] if fitting else "starting Python, and importing modules"


def program(name):
    """Return the path of a benchmark, which may be one of another package."""
    (found,) = glob.glob(os.path.join(HERE, "..", "..", "..", "p*", "*", "benchmarks", name + ".py"))
    return os.path.normpath(found)


def run(name, options, folder):
    """Return the rows of one benchmark, or its own table, or None if it failed. Its other output is written
    to stderr.
    """
    argv = [sys.executable, program(name), *options.split()]
    print(f"== {name} {options}", file=sys.stderr, flush=True)
    if name in OWN_TABLES:
        ended = subprocess.run(argv, stdout=subprocess.PIPE, text=True, check=False)
        return ended.stdout.strip() if ended.returncode == 0 else None
    path = os.path.join(folder, name + ".json")
    ended = subprocess.run([*argv, "--json", path], stdout=sys.stderr, check=False)
    return read_json(path) if ended.returncode == 0 and os.path.exists(path) else None


def run_undisturbed(name, options, folder, tries):
    """Run a benchmark until other programs use little, at most `tries` times. Return its result and the
    load by other programs in percent.
    """
    for _ in range(tries):
        load = Load()
        found = run(name, options, folder)
        percent = load.percent()
        if percent <= MAX_LOAD:
            break
    return found, percent


def machine():
    with open("/proc/cpuinfo") as file:
        models = {line.split(":")[1].strip() for line in file if line.startswith("model name")}
    return f"{os.cpu_count()} processors ({', '.join(sorted(models))}), Python {platform.python_version()}"


def commit():
    """Return the commit that is measured, with a mark if the tree has changes."""
    if shutil.which("git") is None:
        return "unknown"
    asked = ("git", "-C", HERE, "describe", "--always", "--dirty", "--exclude=*")
    found = subprocess.run(asked, capture_output=True, text=True, check=False)
    return found.stdout.strip() or "unknown"


def section(name, words, found, load, measured):
    """Return the table of a benchmark as Markdown, with the conditions of its run.

    Args:
        found: its rows, or the table that it prints itself.
        measured: the commit.
    """
    share = f"{load:.0f} %" if load <= MAX_LOAD else f"**{load:.0f} %**"
    conditions = f"commit {measured}, {time.strftime('%Y-%m-%d')}, {machine()}, foreign load {share}"
    if not isinstance(found, str):
        found = markdown(found, "bound by", bound)
    elif not found.startswith("|"):
        found = f"```text\n{found}\n```"
    return f"`{f'script/bench {name} {words}'.strip()}`: {conditions}.\n\n{found}"


def update(path, sections):
    """Replace the sections of these benchmarks between the two marks in a document; others stay."""
    with open(path) as file:
        before, begin, rest = file.read().partition(BEGIN)
    former, end, after = rest.partition(END)
    if not begin or not end:
        raise SystemExit(f"{path} must have the lines {BEGIN} and {END}; the tables are printed above")
    parts = re.split(r"(?m)^## (\w+)$", former)[1:]
    known = dict(zip(parts[::2], map(str.strip, parts[1::2]))) | sections  # noqa: B905
    text = "\n\n".join(f"## {name}\n\n{known[name]}" for name in ALL if name in known)
    with open(path, "w") as file:
        file.write(f"{before}{begin}\n\n{text}\n\n{end}{after}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=2.0)
    parser.add_argument("--only", default=",".join(ALL))
    parser.add_argument(
        "--update",
        metavar="FILE",
        nargs="?",
        const=RESULTS,
        help="replace the table in RESULTS.md, or in FILE",
    )
    options = parser.parse_args()
    if options.update == RESULTS and options.quick:
        parser.error("--update replaces tables of RESULTS.md; with --quick, name another FILE")
    measured = commit()
    if options.update == RESULTS and measured.endswith(("-dirty", "unknown")):
        parser.error(f"--update measures a commit, but the tree is {measured}; commit your changes first")
    heed_interrupts()
    failed = False
    with tempfile.TemporaryDirectory() as folder:
        svg = os.path.join(DOCS if options.update == RESULTS else folder, "scale.svg")
        for name in options.only.split(","):
            full, words = BENCHMARKS[name] if name in BENCHMARKS else (OWN_TABLES[name], None)
            if not options.quick:
                words = full.format(rounds=options.rounds, seconds=options.seconds, svg=svg)
            if words is None or (name in NEEDS_GENUINE and not GENUINE):
                continue
            found, load = run_undisturbed(name, words, folder, 1 if options.quick else TRIES)
            if found is None:
                failed = True
                print(f"{name} failed; a document keeps its last table", file=sys.stderr)
                continue
            text = section(name, words.replace(svg, "FILE"), found, load, measured)
            print(f"## {name}\n\n{text}\n", flush=True)
            if options.update:
                update(options.update, {name: text})
    if options.update == RESULTS:
        figures.update()
    return failed


if __name__ == "__main__":
    sys.exit(main())

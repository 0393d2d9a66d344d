#!/usr/bin/env python3
"""Nodes in a tab of Chromium: bytes and times of a visit, start of a node, latency, throughput and memory.

    script/bench tab [--nodes 20]

It needs npm, Chromium and Playwright. Nothing else should be running.
"""

import argparse
import contextlib
import functools
import re
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from http.server import ThreadingHTTPServer
from pathlib import Path

import psutil

from tests.browser.chromium import running_chromium
from tests.pyodide.test_tab_page import Files, begin, opened, shows, terminal, write
from tests.support.environments import REPOSITORY

WAIT_S = 300
SMALL_BYTES, LARGE_BYTES = 100, 100_000

START = """
import rospy
rospy.init_node("up", anonymous=True)
print("up " + rospy.get_name(), flush=True)
rospy.spin()
"""
ECHO = """
import rospy
from std_msgs.msg import String
rospy.init_node("echo")
answers = rospy.Publisher("answer", String, queue_size=10)
rospy.Subscriber("question", String, answers.publish)
counts = [0, 0]
def count(message):
    counts[0] += 1
    counts[1] += len(message.data)
rospy.Subscriber("flood", String, count)
print("listening", flush=True)
before, then = [0, 0], rospy.get_time()
while not rospy.is_shutdown():
    rospy.sleep(2.0)
    now = rospy.get_time()
    rates = [(new - old) / (now - then) for new, old in zip(counts, before)]
    if counts[0] > before[0]:
        print("flood %d messages/s, %.1f MB/s" % (rates[0], rates[1] / 1e6), flush=True)
    before, then = list(counts), now
"""
ASK = """
import sys, time
import rospy
from std_msgs.msg import String
rospy.init_node("ask")
heard = []
answers = rospy.Subscriber("answer", String, lambda _: heard.append(time.perf_counter()))
questions = rospy.Publisher("question", String, queue_size=10)
flood = rospy.Publisher("flood", String, queue_size=10)
while not all(each.get_num_connections() for each in (answers, questions, flood)):
    rospy.sleep(0.1)
rospy.sleep(1)
times = []
for _ in range(200):
    begin = time.perf_counter()
    heard.clear()
    questions.publish("?")
    while not heard:
        rospy.sleep(0.001)
    times.append(heard[0] - begin)
print("one way %.3f ms" % (sorted(times)[100] / 2 * 1e3), flush=True)
for size in (SIZES):
    end = time.monotonic() + 6
    text = "x" * size
    while time.monotonic() < end:
        flood.publish(text)
    print("sent %d" % size, flush=True)
    rospy.sleep(4)
print("done", flush=True)
"""


@contextlib.contextmanager
def served(folder):
    """Serve a folder on a free port, and provide the address."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Files, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://localhost:{server.server_address[1]}/"
    server.shutdown()


def line(label, value):
    print(f"{label:<58} {value}", flush=True)


def seconds_until(page, text, number=0, count=1):
    """Return the time until a terminal shows a text so often."""
    since = time.monotonic()
    while terminal(page, number).inner_text().count(text) < count:
        if time.monotonic() > since + WAIT_S:
            raise SystemExit(f"{text!r} is missing in:\n{terminal(page, number).inner_text()}")
        time.sleep(0.02)
    return time.monotonic() - since


def tab_bytes():
    """Return the memory that only the tab's process uses: the largest of the browser's processes."""
    return max(each.memory_full_info().uss for each in psutil.Process().children(recursive=True))


def measure_visits(browser, address):
    with opened(browser, address) as page:
        line(
            "first visit: until all three prompts",
            f"{max(seconds_until(page, '$', each) for each in range(3)):.1f} s",
        )
        page.reload()
        line(
            "reload: until all three prompts",
            f"{max(seconds_until(page, '$', each) for each in range(3)):.1f} s",
        )


def measure_nodes(page, nodes):
    seconds_until(page, "$")  # before, the page may load itself again
    for name, text in (
        ("start.py", START),
        ("echo.py", ECHO),
        ("ask.py", ASK.replace("SIZES", f"{SMALL_BYTES}, {LARGE_BYTES}")),
    ):
        write(page, name, text)
    begin(page, "roscore")
    shows(page, "started core service")
    time.sleep(3)
    begin(page, "python3 start.py &", 1)
    line("start of a node", f"{seconds_until(page, 'up /up', 1):.1f} s")
    time.sleep(3)
    begin(page, "python3 start.py & python3 start.py &", 1)
    line(
        "start of a node without a spare worker, beside another",
        f"{seconds_until(page, 'up /up', 1, 3):.1f} s",
    )
    begin(page, "python3 echo.py", 2)
    shows(page, "listening", 2)
    begin(page, "python3 ask.py", 1)
    seconds_until(page, "done", 1)
    line("from one node to another", re.search(r"one way (.*)", terminal(page, 1).inner_text())[1])
    floods = re.findall(r"flood (\d+) messages/s, ([\d.]+) MB/s", terminal(page, 2).inner_text())
    small = [int(rate) for rate, megabytes in floods if float(megabytes) < int(rate) * LARGE_BYTES / 2e6]
    line(f"messages of {SMALL_BYTES} bytes", f"{statistics.median(small):.0f} a second")
    line(f"messages of {LARGE_BYTES} bytes", f"{max(float(megabytes) for _, megabytes in floods):.0f} MB/s")
    terminal(page, 2).locator("input").press("Control+c")
    time.sleep(5)
    before = tab_bytes()
    launch = "".join(
        f'<node pkg="rospy_tutorials" type="talker.py" name="n{each}"/>' for each in range(nodes)
    )
    write(page, "many.launch", f"<launch>{launch}</launch>")
    begin(page, "roslaunch many.launch", 2)
    since = time.monotonic()
    begin(page, f"rostopic echo -n{nodes * 20} /chatter > out.txt; rosnode list; echo listed", 1)
    seconds_until(page, "listed", 1, 2)
    running = len(set(re.findall(r"/n\d+", terminal(page, 1).inner_text())))
    line(
        f"{nodes} nodes at once: running, until {nodes * 20} messages",
        f"{running}, {time.monotonic() - since:.1f} s",
    )
    line("memory of a node", f"{(tab_bytes() - before) / nodes / 1e6:.0f} MB")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nodes", type=int, default=20)
    nodes = parser.parse_args().nodes
    with tempfile.TemporaryDirectory() as folder, running_chromium() as browser:
        subprocess.run(
            [
                sys.executable,
                REPOSITORY / "plugins/pipros-tab/tests/support/pyodide_files.py",
                folder,
                "--tab",
            ],
            check=True,
        )
        size = sum(file.stat().st_size for file in Path(folder).rglob("*") if file.is_file())
        line("first visit: bytes of all files", f"{size / 1e6:.1f} MB")
        with served(folder) as address:
            measure_visits(browser, address)
            with opened(browser, address) as page:
                measure_nodes(page, nodes)


if __name__ == "__main__":
    main()

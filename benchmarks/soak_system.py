"""A long run of a whole system, to measure the resources of each process.

Started by `benchmarks/soak.py --system`. The system consists of roscore, a page that is being viewed, a
recorder for all topics, frames and a listener, an action server and a client, parameter changes, service
calls, and a launch with two nodes that end repeatedly and are restarted. Every ten seconds, the memory,
threads and descriptors of each process are recorded. The verdict compares the last fifth of the time with the
second fifth.
"""

from __future__ import annotations

import asyncio
import json
import os
import random
import re
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import urlopen

from websockets.asyncio.client import connect

BIN = Path(sys.executable).parent
SAMPLE_S = 10.0
#: The allowed growth of a process between the warm-up and the end.
MEMORY_SLACK_MB, THREADS_SLACK, FILES_SLACK = 6.0, 3, 5
FIFTHS = 5

NODES = {
    "talker": """
import rospy
from std_msgs.msg import String
from std_srvs.srv import Trigger, TriggerResponse
rospy.init_node("talker")
publisher, rate, count = rospy.Publisher("chat", String, queue_size=10), rospy.Rate(50), 0
rospy.Service("ask", Trigger, lambda _: TriggerResponse(True, str(count)))
while not rospy.is_shutdown():
    count += 1
    publisher.publish(str(count))
    rate.sleep()
""",
    "frames": """
import rospy, tf2_ros
from geometry_msgs.msg import TransformStamped
rospy.init_node("frames")
broadcaster, rate = tf2_ros.TransformBroadcaster(), rospy.Rate(50)
while not rospy.is_shutdown():
    sent = []
    for number in range(10):
        made = TransformStamped()
        made.header.stamp, made.header.frame_id = rospy.Time.now(), f"frame_{number}"
        made.child_frame_id, made.transform.rotation.w = f"frame_{number + 1}", 1.0
        sent.append(made)
    broadcaster.sendTransform(sent)
    rate.sleep()
""",
    "server": """
import actionlib, rospy
from actionlib.msg import TestAction, TestFeedback
rospy.init_node("server")
def work(goal):
    server.publish_feedback(TestFeedback(goal.goal))
    server.set_succeeded()
server = actionlib.SimpleActionServer("go", TestAction, work, auto_start=False)
server.start()
rospy.spin()
""",
    "client": """
import actionlib, json, rospy, tf2_ros
from actionlib.msg import TestAction, TestGoal
from actionlib_msgs.msg import GoalStatus
from std_msgs.msg import String
from std_srvs.srv import Trigger
rospy.init_node("client")
done = dict.fromkeys(("messages", "lookups", "goals", "calls", "parameters", "failures"), 0)
def hear(_):
    done["messages"] += 1
rospy.Subscriber("chat", String, hear)
buffer = tf2_ros.Buffer(rospy.Duration(5))
listener = tf2_ros.TransformListener(buffer)
client, ask = actionlib.SimpleActionClient("go", TestAction), rospy.ServiceProxy("ask", Trigger)
client.wait_for_server()
ask.wait_for_service()
rate, turn = rospy.Rate(10), 0
def attempt(what, work):
    try:
        good = work()
    except (rospy.ROSException, rospy.ServiceException, tf2_ros.TransformException) as error:
        good = False
        rospy.logwarn("%s: %s", what, error)
    done[what if good else "failures"] += 1
def set_and_get():
    rospy.set_param("/soak/turn", turn)
    return rospy.get_param("/soak/turn") == turn
wait = rospy.Duration(10)
while not rospy.is_shutdown():
    turn += 1
    attempt("lookups", lambda: buffer.lookup_transform("frame_0", "frame_10", rospy.Time(0), wait))
    attempt("goals", lambda: client.send_goal_and_wait(TestGoal(turn), wait) == GoalStatus.SUCCEEDED)
    attempt("calls", lambda: ask().success)
    attempt("parameters", set_and_get)
    if turn % 50 == 0:
        print(json.dumps(done), flush=True)
    rate.sleep()
""",
}
ENDING = """#!/usr/bin/env python3
import sys, rospy
from std_msgs.msg import String
rospy.init_node("ending")
heard = []
rospy.Subscriber("/chat", String, heard.append)
rospy.Publisher("said", String, queue_size=1, latch=True).publish("here")
rospy.sleep(rospy.get_param("~lives"))
sys.exit(rospy.get_param("~code"))
"""
LAUNCH = """<launch>
  <node name="ends" pkg="soak" type="ending.py" respawn="true" ns="a">
    <param name="lives" value="3.0"/> <param name="code" value="0"/>
  </node>
  <node name="fails" pkg="soak" type="ending.py" respawn="true" ns="b">
    <param name="lives" value="5.0"/> <param name="code" value="3"/>
  </node>
</launch>"""


@dataclass(slots=True)
class Held:
    """A process's resources, sample by sample."""

    pid: int
    megabytes: list[float] = field(default_factory=list)
    threads: list[float] = field(default_factory=list)
    files: list[float] = field(default_factory=list)

    def sample(self) -> None:
        """Record the process's current resources.

        Raises:
            OSError: the process has ended.
        """
        status = Path(f"/proc/{self.pid}/status").read_text()
        self.megabytes.append(int(_field(status, "VmRSS")) / 1024)
        self.threads.append(int(_field(status, "Threads")))
        self.files.append(len(os.listdir(f"/proc/{self.pid}/fd")))

    def growth(self) -> tuple[float, float, float]:
        """Return the median growth from the second to the last fifth of the samples."""
        return _growth(self.megabytes), _growth(self.threads), _growth(self.files)

    @property
    def is_flat(self) -> bool:
        megabytes, threads, files = self.growth()
        return megabytes <= MEMORY_SLACK_MB and threads <= THREADS_SLACK and files <= FILES_SLACK


def _field(status: str, name: str) -> str:
    found = re.search(rf"{name}:\s+(\d+)", status)
    return found[1] if found else "0"


def _growth(values: list[float]) -> float:
    size = max(1, len(values) // FIFTHS)
    return statistics.median(values[-size:]) - statistics.median(values[size : 2 * size] or values[:size])


class System:
    """All processes, started in their own folder."""

    def __init__(self, folder: Path) -> None:
        with socket.create_server(("127.0.0.1", 0)) as probe:
            port = probe.getsockname()[1]
        self.folder = folder
        self.environment = {
            **os.environ,
            "PATH": f"{BIN}:/usr/bin:/bin",
            "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
            "ROS_HOME": str(folder),
            "ROS_PACKAGE_PATH": str(folder),
            "PYTHONUNBUFFERED": "1",
        }
        self.running: dict[str, subprocess.Popen[str]] = {}
        package = folder / "soak"
        package.mkdir()
        (package / "package.xml").write_text("<package><name>soak</name></package>")
        (package / "soak.launch").write_text(LAUNCH)
        (package / "ending.py").write_text(ENDING)
        (package / "ending.py").chmod(0o755)
        self.start("roscore", "roscore", "-p", str(port))
        wait_for(self.output("roscore"), r"started core service")
        for name, script in NODES.items():
            self.start(name, sys.executable, "-c", script)
        self.start("roslaunch", "roslaunch", "soak", "soak.launch")
        options = ("--split", "--size=4", "--max-splits=3", "-O", str(folder / "all"))
        self.start("rosbag record", "rosbag", "record", "-a", *options)
        self.start("rqt_graph", "rqt_graph", "--no-browser")
        self.url = wait_for(self.output("rqt_graph"), r"http://\S+")

    def start(self, name: str, *command: str) -> None:
        with self.output(name).open("w") as output:
            self.running[name] = subprocess.Popen(
                command,
                env=self.environment,
                cwd=self.folder,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                text=True,
            )

    def output(self, name: str) -> Path:
        return self.folder / f"{name.replace(' ', '_')}.output"

    def done(self) -> dict[str, int]:
        """Return the client's counts so far."""
        lines = [line for line in self.output("client").read_text().splitlines() if line.startswith("{")]
        return json.loads(lines[-1]) if lines else {}

    def starts(self) -> int:
        """Return the number of nodes that roslaunch started."""
        return self.output("roslaunch").read_text().count("started with pid")

    def close(self) -> None:
        for process in reversed(self.running.values()):
            process.send_signal(signal.SIGINT)
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()


def wait_for(output: Path, pattern: str, limit_s: float = 60.0) -> str:
    deadline = time.monotonic() + limit_s
    while time.monotonic() < deadline:
        if found := re.search(pattern, output.read_text()):
            return found[0]
        time.sleep(0.05)
    raise SystemExit(f"{output} has no /{pattern}/ after {limit_s} s:\n{output.read_text()}")


async def look(url: str, counts: dict[str, int]) -> None:
    """Act as a browser that keeps some views open, sometimes loads the page's files, and reconnects each
    minute.
    """
    parts = urlsplit(url)
    token = parts.fragment.partition("/")[0].removeprefix("token=")
    views = (("graph", {}), ("topic", {"name": "/chat"}), ("plot", {"field": "/go/status/header/seq"}))
    while True:
        async with connect(
            f"ws://{parts.netloc}/live",
            origin=f"http://{parts.netloc}",
            max_size=None,
            proxy=None,
        ) as live:
            await live.send(json.dumps({"token": token}))
            for number, (view, args) in enumerate(views):
                await live.send(json.dumps({"id": number, "view": view, "args": args}))
            end = time.monotonic() + 60
            while time.monotonic() < end:
                await asyncio.wait_for(live.recv(), 60)
                counts["updates"] += 1
                if counts["updates"] % 20 == 0:
                    address = f"http://{parts.netloc}/"
                    await asyncio.to_thread(lambda address=address: urlopen(address, timeout=30).read())  # noqa: S310
                    counts["pages"] += 1


async def watch(system: System, minutes: float, say: Callable[[str], None]) -> tuple[dict[str, Held], dict]:
    held = {name: Held(process.pid) for name, process in system.running.items()}
    counts = {"updates": 0, "pages": 0}
    browser = asyncio.create_task(look(system.url, counts))
    begin = time.monotonic()
    try:
        for number in range(1, max(FIFTHS * 2, int(minutes * 60 / SAMPLE_S)) + 1):
            await asyncio.sleep(max(0.0, begin + number * SAMPLE_S - time.monotonic()))
            for process in held.values():
                process.sample()
            if browser.done():
                browser.result()
            if number % 6 == 0:
                sizes = " ".join(f"{name} {one.megabytes[-1]:.0f}" for name, one in held.items())
                say(f"{number * SAMPLE_S / 60:5.1f} min, MB: {sizes}; {system.done()} {counts}")
    finally:
        while not browser.done():  # wait_for in Python 3.11 and older may swallow a cancellation
            browser.cancel()
            await asyncio.wait([browser], timeout=1)
    return held, counts


def soak_system(minutes: float) -> int:
    """Run everything for the given time, and print a table. Return 1 if a process grew or a call failed."""
    random.seed(1)
    with tempfile.TemporaryDirectory() as folder:
        system = System(Path(folder))
        try:
            held, counts = asyncio.run(watch(system, minutes, lambda line: print(line, flush=True)))
            done, starts = system.done(), system.starts()
        except BaseException:
            for name in system.running:
                print(f"== {name}\n{system.output(name).read_text()[-2000:]}", file=sys.stderr)
            raise
        finally:
            system.close()
    print("\n| process | MB | grown by | threads | grown by | descriptors | grown by |")
    print("| --- |" + " ---: |" * 6)
    for name, one in held.items():
        last = (one.megabytes[-1], one.threads[-1], one.files[-1])
        cells = [f"{value:.1f} | {more:+.1f}" for value, more in zip(last, one.growth(), strict=True)]
        print(f"| {name} | {' | '.join(cells)} |")
    print(f"\n{done}; the page: {counts}; nodes started by roslaunch: {starts}")
    grown = [name for name, one in held.items() if not one.is_flat]
    failures = done.get("failures", 0)
    idle = [what for what, count in {**done, **counts}.items() if not count and what != "failures"]
    print(f"verdict: {'flat' if not grown else 'grown: ' + ', '.join(grown)}; {failures} failures")
    if idle:
        print(f"never happened: {', '.join(idle)}")
    return int(bool(grown or failures or idle))

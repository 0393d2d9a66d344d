"""Recordings that the page makes in its bag folder."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from pipros_tools.bag import BagReader
from tests.support.page import LivePage, Page
from tests.support.ros import RosSystem

NUMBERS = """
import rospy
from std_msgs.msg import Float64
rospy.init_node("numbers")
one, other = (rospy.Publisher(name, Float64, queue_size=10) for name in ("/one", "/other"))
rate = rospy.Rate(50)
while not rospy.is_shutdown():
    if not rospy.get_param("/together", False) or one.get_num_connections() and other.get_num_connections():
        one.publish(1.0)
        other.publish(2.0)
    rate.sleep()
"""


@pytest.fixture
def numbers(ros: RosSystem) -> RosSystem:
    """A bare master, and a node that publishes `/one` and `/other`."""
    ros.serve_master()
    ros.pipros.start(sys.executable, "-c", NUMBERS)
    ros.wait_for_publisher("/other")
    return ros


def states(browser: LivePage) -> Iterator[dict[str, object]]:
    return (value["recording"] for value in browser.watch("recording") if value["recording"])


def topics_in(path: Path) -> set[str]:
    with BagReader(path) as bag:
        return {topic for topic, _, _, _ in bag.messages()}


def test_checked_topics_are_recorded_until_the_browser_stops_it(numbers: RosSystem, tmp_path: Path) -> None:
    with Page(numbers, "--control", "--bags", tmp_path).connect() as browser:
        assert browser.act("record", name="run", topics=["/one"]) is True
        assert "being recorded" in browser.act("record", name="second")["error"]
        state = next(state for state in states(browser) if int(str(state["messages"])) > 10)
        assert (state["name"], state["is_running"], state["topics"]) == ("run.bag", True, 1)
        assert browser.act("stop_recording") is True
        assert not next(states(browser))["is_running"]
        assert "already exists" in browser.act("record", name="run")["error"]
    assert topics_in(tmp_path / "run.bag") == {"/one"}


def test_a_recording_ends_at_its_size_and_with_the_page(numbers: RosSystem, tmp_path: Path) -> None:
    numbers.pipros.run("rosparam", "set", "/together", "true")  # or the file may be full before it has both
    page = Page(numbers, "--control", "--bags", tmp_path)
    with page.connect() as browser:
        assert browser.act("record", name="small", size=10_000) is True
        next(state for state in states(browser) if not state["is_running"])
        assert {"/one", "/other"} <= topics_in(tmp_path / "small.bag")
        assert browser.act("record", name="all.mcap") is True
        next(state for state in states(browser) if int(str(state["messages"])) > 10)
    page.process.press_ctrl_c()
    page.process.wait()
    assert (tmp_path / "all.mcap").is_file()
    assert not list(tmp_path.glob("*.active"))


def test_a_recording_stops_when_the_disk_is_nearly_full(numbers: RosSystem, tmp_path: Path) -> None:
    page = Page(numbers, "--control", "--bags", tmp_path, PIPROS_LIMITS=f"page_record_spare_bytes={1 << 60}")
    with page.connect() as browser:
        assert "too little space" in browser.act("record")["error"]


@pytest.mark.parametrize("name", ["../run", "a/b", "/tmp/run", ".hidden", "x" * 120])  # noqa: S108
def test_names_lead_nowhere_else(numbers: RosSystem, tmp_path: Path, name: str) -> None:
    with Page(numbers, "--control", "--bags", tmp_path).connect() as browser:
        assert "the name of a recording must" in browser.act("record", name=name)["error"]

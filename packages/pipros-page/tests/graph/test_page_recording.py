"""Recordings that the page makes in its bag folder."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from rosgraph_msgs.msg import Log
from std_msgs.msg import Float64

from pipros_tools.bag import BagReader
from tests.support.bags import bag_bytes
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


# Curves and marks of a whole bag, as the Plot tab shows them.


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """A bag with ten numbers, and an error in the log."""
    numbers = [("/number", Float64(second), 1000 + second, 0) for second in range(10)]
    error = "/rosout", Log(level=Log.ERROR, name="/arm", msg="stuck"), 1009, 0
    path = tmp_path / "run.bag"
    path.write_bytes(bag_bytes([*numbers, error]))
    return path


def whole(browser: LivePage, view: str, key: str, count: int = 1, **args: str) -> list[object]:
    """Return this number of values, which may come in pieces, or the error."""
    found: list[object] = []
    for data in browser.watch(view, name="run.bag", **args):
        found += data.get(key, [])
        if len(found) >= count:
            break
        if data.get("error"):
            return [data["error"]]
    return found


def test_a_whole_bag_has_curves_and_marks(ros: RosSystem, bag: Path) -> None:
    ros.serve_master()
    with Page(ros, "--bags", bag.parent).connect() as browser:
        refused = next(browser.watch("bag_curve", name="run.bag", field="/number/data"))
        assert "has not opened a bag" in refused["error"]
        next(data for data in browser.watch("bag", name="run.bag") if "bag" in data)
        curve = whole(browser, "bag_curve", "samples", 10, field="/number/data")
        assert curve == [[1000.0 + second, second] for second in range(10)]
        squares = whole(browser, "bag_curve", "samples", 10, field="/number=m.data ** 2", axis="ros")
        assert squares[-1] == [1009.0, 81]
        assert whole(browser, "bag_marks", "marks") == [[1009.0, 8, "/arm: stuck"]]
        assert "does not contain the topic" in str(whole(browser, "bag_curve", "samples", field="/other"))
        assert "have no header" in str(whole(browser, "bag_curve", "samples", field="/number", axis="stamp"))

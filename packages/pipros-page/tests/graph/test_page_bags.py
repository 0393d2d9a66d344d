"""Curves and marks of a whole bag, as the Plot tab shows them."""

from __future__ import annotations

from pathlib import Path

import pytest
from rosgraph_msgs.msg import Log
from std_msgs.msg import Float64

from tests.support.bags import bag_bytes
from tests.support.page import LivePage, Page
from tests.support.ros import RosSystem


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

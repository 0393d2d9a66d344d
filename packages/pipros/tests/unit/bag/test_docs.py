"""The Python examples of docs/bags.md run."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from std_msgs.msg import String

import rosbag
import rospy
from pipros.cli.rosbag.converting import convert
from tests.support.environments import REPOSITORY

DOCUMENT = (REPOSITORY / "docs" / "bags.md").read_text()


def test_the_examples_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    message = String("hello")
    for name in ("run.bag", "cut.bag", "a.bag", "b.bag"):
        with rosbag.Bag(name, "w") as bag:
            for second in range(1, 31):
                bag.write("/scan", message, rospy.Time(second))
    names: dict[str, object] = {"message": message, "seconds": 5, "nanoseconds": 6}
    assert convert(["b.bag", "b.mcap"]) == 0
    examples = re.findall(r"^```python\n(.*?)^```", DOCUMENT, re.MULTILINE | re.DOTALL)
    assert len(examples) == 3

    for example in examples:
        exec(example, names)  # noqa: S102 # our own document

    with rosbag.Bag("new.bag") as bag:
        assert [(topic, m.data, str(t)) for topic, m, t in bag.read_messages()] == [
            ("/chatter", "hello", "5000000006")
        ]

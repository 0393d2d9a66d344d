"""The five checks of episodes, each with a defect that it finds and a recording without one."""

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest
from sensor_msgs.msg import CompressedImage, JointState

from pipros.msg.time import Time
from pipros_data.commands.dataset import main as dataset
from tests.support.bags import Row, bag_bytes

CONFIG = """\
rate: 10
gaps: hold
checks: {frozen: 0.5}
observations: {joint: {topic: /joint, names: [a], min: -1, max: 1}}
cameras: {eye: {topic: /eye, store: jpeg}}
"""


def found(
    tmp_path: Path, times: dict[str, list[float]], values: dict[int, float], *, late: int = -1
) -> list[str]:
    """Return the findings in a bag with messages at these times (s), as `check source: text`."""
    rows: list[Row] = []
    for n, at in enumerate(times["joint"]):
        ns = round((100 + at) * 1e9)
        state = JointState(name=["a"], position=[values.get(n, 0.01 * n)])
        state.header.stamp = Time(*divmod(ns + (10**9 if n == late else 0), 10**9))
        rows.append(("/joint", state, *divmod(ns, 10**9)))
    for n, at in enumerate(times["eye"]):
        picture = CompressedImage(
            format="jpeg", data=b"\xff\xd8" + bytes([n if values is not FROZEN_EYE else 7])
        )
        ns = round((100 + at) * 1e9)
        picture.header.stamp = Time(*divmod(ns, 10**9))
        rows.append(("/eye", picture, *divmod(ns, 10**9)))
    (tmp_path / "run.bag").write_bytes(bag_bytes(sorted(rows, key=lambda row: row[2:])))
    (tmp_path / "robot.yaml").write_text(CONFIG)
    out = tmp_path / "out"
    command = [str(tmp_path / "run.bag"), "--config", str(tmp_path / "robot.yaml"), "-o", str(out), "-j1"]
    assert dataset(command) == 0
    result = json.loads((out / "checks" / "episode_000000.json").read_text())
    lines = [f"{each['check']} {each['source']}: {each['text']}" for each in result["findings"]]
    ends = [second for each in result["findings"] for span in each["spans"] for second in span]
    assert all(0 <= second <= max(STEADY) for second in ends)
    report = (out / "report.md").read_text()
    for each in result["findings"]:
        assert f"- {each['source']}: {each['check']}: {each['text']}" in report
    drawing = ElementTree.parse(out / "checks" / "episode_000000.svg")  # noqa: S314 # our own
    spans = list(drawing.iter("{http://www.w3.org/2000/svg}title"))
    assert len(spans) == sum(len(each["spans"]) for each in result["findings"])
    return lines


STEADY = [n / 10 for n in range(41)]
GAP = [at for at in STEADY if not 1.05 < at < 1.35]
FROZEN_EYE: dict[int, float] = {}
STILL = dict.fromkeys(range(10, 21), 0.5)


@pytest.mark.parametrize(("times", "values", "late", "expected"), [
    ({}, {}, -1, []),
    ({"eye": GAP}, {}, -1, ["missing cameras.eye: 3 missing in 0.400 s"]),
    (
        {},
        {},
        5,
        ["clock observations.joint: stamps jump by +1.000 s; stamps jump by -1.000 s"],
    ),
    ({}, STILL, -1, ["frozen observations.joint: a does not change for 1.0 s"]),
    (
        {},
        {n: 1 + n / 100 for n in range(10, 15)},
        -1,
        ["saturated observations.joint: a is at or beyond a limit for 0.4 s"],
    ),
    ({"joint": STEADY[:21]}, {}, -1, ["stopped observations.joint: no message in the last 2.0 s"]),
    ({}, FROZEN_EYE, -1, ["frozen cameras.eye: picture does not change for 4.0 s"]),
], ids=["sound", "missing", "clock", "frozen", "saturated", "stopped", "frozen picture"])  # fmt: skip
def test_each_check_finds_its_defect_and_nothing_else(
    times: dict[str, list[float]], values: dict[int, float], late: int, expected: list[str], tmp_path: Path
) -> None:
    lines = found(tmp_path, {"joint": STEADY, "eye": STEADY, **times}, values, late=late)
    if late >= 0:  # the message with the wrong stamp is also missing among those that are aligned
        assert lines.pop(0) == "missing observations.joint: 1 missing in 0.200 s"
    assert lines == expected


def test_a_check_can_be_turned_off(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        f"{__name__}.CONFIG", CONFIG.replace("store: jpeg", "store: jpeg, checks: {missing: 0}")
    )
    assert found(tmp_path, {"joint": STEADY, "eye": GAP}, {}) == []

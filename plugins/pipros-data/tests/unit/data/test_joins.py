"""As-of joins and transforms as columns."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import PointStamped, TransformStamped
from sensor_msgs.msg import Imu
from std_msgs.msg import Int32
from tf2_msgs.msg import TFMessage

from pipros.msg.time import Time
from pipros_data import Bags, Table, open_bags
from pipros_data.frames import with_transform
from pipros_data.nearest import matches
from pipros_libraries.transforms.buffer import TransformBuffer
from tests.support.bags import Row, bag_bytes
from tests.unit.data.cells import seeded


def opened(folder: Path, rows: list[Row]) -> Bags:
    (folder / "run.bag").write_bytes(bag_bytes(sorted(rows, key=lambda row: row[2:])))
    return open_bags(folder / "run.bag")


def point(topic: str, seconds: int, stamp: int, x: float = 0) -> Row:
    message = PointStamped()
    message.header.stamp = Time(stamp, 0)
    message.point.x = x
    return topic, message, seconds, 0


def brute_force(time: int, others: list[int], tolerance: int | None, direction: str) -> int | None:
    """Return the time that belongs to another one, or None."""
    found = [each for each in others if (direction != "backward" or each <= time)]
    found = [each for each in found if direction != "forward" or each >= time]
    best = min(found, key=lambda each: (abs(each - time), each), default=None)
    return None if best is None or (tolerance is not None and abs(best - time) > tolerance) else best


@pytest.mark.parametrize("direction", ["backward", "forward", "nearest"])
@pytest.mark.parametrize("tolerance", [None, 0, 3])
def test_matches_equal_those_of_a_plain_search(direction: str, tolerance: int | None) -> None:
    rng = seeded(1)
    for _ in range(100):
        times = [rng.randrange(40) for _ in range(20)]
        others = [rng.randrange(40) for _ in range(rng.randrange(12))]
        limit = None if tolerance is None else tolerance / 1e9

        index, is_gap = matches(np.array(times), np.array(others, np.int64), limit, direction)

        got = [None if gap else others[at] for at, gap in zip(index, is_gap, strict=True)]
        assert got == [brute_force(time, others, tolerance, direction) for time in times]


def test_rows_get_the_columns_of_other_topics(tmp_path: Path) -> None:
    rows: list[Row] = [("/a", Int32(n), n, 0) for n in (10, 20, 30)]
    rows += [("/b/c", Int32(-n), n, 500_000_000) for n in (9, 19, 25)]
    with opened(tmp_path, rows) as bags:
        table = bags.asof("/a", "/b/c", tolerance=1)

    assert (table["b/c.data"].tolist(), table["data"].tolist()) == ([-9, -19, None], [10, 20, 30])
    assert table.to_arrow()["b/c._time"].to_pylist() == [9_500_000_000, 19_500_000_000, None]


def test_header_times_are_joined_in_any_order_of_receipt(tmp_path: Path) -> None:
    rows = [point("/a", 10, 3), point("/a", 11, 1), point("/b", 12, 2, x=2.0), point("/b", 13, 1, x=1.0)]
    with opened(tmp_path, [*rows, ("/n", Int32(), 14, 0)]) as bags:
        table = bags.asof("/a", "/b", on="header")
        assert (table["b.point.x"].tolist(), list(table["b.header.frame_id"])) == ([2.0, 1.0], ["", ""])
        with pytest.raises(ValueError, match="/n: std_msgs/Int32 has no header; use on='receipt'"):
            bags.asof("/a", "/n", on="header")
        with pytest.raises(ValueError, match="direction must be one of backward, forward, nearest, got 'x'"):
            bags.asof("/a", "/b", direction="x")
        with pytest.raises(ValueError, match="tolerance must be >= 0, got -1"):
            bags.asof("/a", "/b", tolerance=-1)
        with pytest.raises(ValueError, match="on must be receipt or header, got 'x'"):
            bags.asof("/a", "/b", on="x")
        with pytest.raises(ValueError, match=r"the column b\._time must be new"):
            bags.asof("/a", "/b", "/b")


def test_a_join_with_nothing_in_range_has_only_gaps(tmp_path: Path) -> None:
    rows: list[Row] = [("/a", Int32(1), 10, 0), ("/t", TFMessage([TransformStamped()]), 11, 0)]
    with opened(tmp_path, rows) as bags:
        table = bags.table("/a").asof(bags.table("/t", start=100))
        late = bags.table("/a").asof(bags.table("/t"))
    assert table.to_arrow()["t.transforms"].to_pylist() == [None]
    assert late.to_arrow()["t.transforms"].to_pylist() == [None]


def transform(seconds: float, x: float, child: str = "arm", parent: str = "base") -> TransformStamped:
    found = TransformStamped(child_frame_id=child)
    found.header.frame_id, found.header.stamp = parent, Time.from_sec(seconds)
    found.transform.translation.x = x
    angle = x / 10
    found.transform.rotation.z, found.transform.rotation.w = np.sin(angle / 2), np.cos(angle / 2)
    return found


def tf_rows(stamps: list[float]) -> list[Row]:
    rows: list[Row] = [("/tf_static", TFMessage([transform(0, 0.5, "hand", "arm")]), 90, 0)]
    for stamp in stamps:
        received = Time.from_sec(stamp + 0.25)
        rows.append(("/tf", TFMessage([transform(stamp, stamp - 10)]), received.secs, received.nsecs))
    return rows


def test_poses_are_those_of_a_tf_buffer_and_gaps_are_null(tmp_path: Path) -> None:
    stamps = [10.0, 11.0, 12.5, 14.0, 60.0, 61.0]
    times = [5, 10, 11, 12, 13, 14, 30, 60, 61, 62]
    rows = [*tf_rows(stamps), *(point("/p", 100 + n, time) for n, time in enumerate(times))]
    with opened(tmp_path, rows) as bags:
        table = bags.with_transform(bags.table("/p"), "base", "hand", gap=5)
        with pytest.warns(UserWarning, match="unknown frame 'leg'; known: .*hand"):
            unknown = bags.with_transform(bags.table("/p"), "base", "leg", prefix="leg_")
        received = with_transform(bags.table("/p"), bags.readers, "base", "hand", on="receipt")

    buffer = TransformBuffer(10**12)
    for stamp in stamps:
        each = transform(stamp, stamp - 10).transform
        pose = (each.translation.x, 0.0, 0.0, 0.0, 0.0, each.rotation.z, each.rotation.w)
        buffer.insert("base", "arm", int(stamp * 1e9), pose, "")
    static = transform(0, 0.5).transform
    buffer.insert("arm", "hand", 0, (0.5, 0, 0, 0, 0, static.rotation.z, static.rotation.w), "", True)
    names = [f"hand.{part}" for part in ("x", "y", "z", "qx", "qy", "qz", "qw")]
    got: list[Any] = list(zip(*(table[name].tolist() for name in names), strict=True))
    gaps = [5, 30, 62]
    for time, pose in zip(times, got, strict=True):
        expected = (None,) * 7 if time in gaps else buffer.lookup("base", "hand", time * 10**9)[1]
        assert pose == expected, time
    assert table.to_arrow()["hand.x"].null_count == 3
    assert unknown["leg_x"].tolist() == received["hand.x"].tolist() == [None] * len(times)


def test_a_gap_must_be_positive(tmp_path: Path) -> None:
    with (
        opened(tmp_path, [point("/p", 1, 1)]) as bags,
        pytest.raises(ValueError, match="gap must be > 0, got 0"),
    ):
        bags.with_transform(bags.table("/p"), "a", "b", gap=0)


def test_columns_of_another_length_are_refused(tmp_path: Path) -> None:
    with opened(tmp_path, [point("/p", 1, 1)]) as bags:
        table: Table = bags.table("/p")
    with pytest.raises(ValueError, match="the column y must be new and have 1 rows, got 2 rows"):
        table.with_columns({"y": np.zeros(2)})
    assert table.with_columns({"y": np.ones(1)}).take([0])["y"].tolist() == [1.0]


def test_gaps_of_fixed_arrays_are_nulls(tmp_path: Path) -> None:
    rows: list[Row] = [("/a", Int32(n), n, 0) for n in (10, 20)]
    imu = Imu(orientation_covariance=[float(n) for n in range(9)])
    with opened(tmp_path, [*rows, ("/imu", imu, 15, 0)]) as bags:
        table = bags.asof("/a", "/imu")
    cells = table.to_arrow()["imu.orientation_covariance"].to_pylist()
    assert cells == [None, [float(n) for n in range(9)]]

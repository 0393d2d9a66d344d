"""`pipros dataset`: rows, gaps, episodes, pictures, formats, interruption and parallel runs."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import av
import duckdb
import h5py
import numpy as np
import pyarrow.parquet
import pytest
from geometry_msgs.msg import Twist, TwistStamped
from sensor_msgs.msg import Image, Imu, JointState, LaserScan
from std_msgs.msg import Bool, Float64, String

from pipros.msg.time import Time
from pipros_data.commands.dataset import main as dataset
from pipros_tools.bag import BagReader, contents
from tests.support.bags import Row, bag_bytes
from tests.support.waiting import wait_until
from tests.unit.data.demonstrations import CONFIG, demonstration, joints, jpeg, made, ns, picture


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("robot.yaml").write_text(CONFIG)
    demonstration(Path("run.bag"), 100.0)


def test_rows_have_the_last_message_before_them() -> None:
    table = made()

    assert table.num_rows == 21  # 100.05 to 102.05
    assert table["timestamp"].to_pylist() == pytest.approx([n / 10 for n in range(21)])
    assert table["task"].unique().to_pylist() == ["lift the cup"]
    joints = [pytest.approx([-1000 - n, 1000 + n]) for n in range(21)]  # the message 0.05 s before the row
    assert table["observations.joints"].to_pylist() == joints
    commands = [n // 5 * 5 for n in range(21)]
    assert table["actions.base"].to_pylist() == [[n, -n] for n in commands]
    described = table.schema.field("observations.joints").metadata
    assert (described[b"unit"], described[b"names"]) == (b"deg", b"['b', 'a']")
    assert described[b"max"] == b"[1000.0, 1000.0]"


def test_videos_have_a_frame_for_each_row() -> None:
    made()

    with av.open("out/videos/front/episode_000000.mp4") as video:
        stream = video.streams.video[0]
        frames = [frame.to_ndarray(format="rgb24") for frame in video.decode(stream)]
        assert (stream.codec.name, stream.average_rate) == ("h264", 10)
    assert len(frames) == 21
    for n, frame in enumerate(frames):
        assert frame.shape == (32, 48, 3)
        assert abs(float(frame.mean()) - 10 * n) < 4


def test_jpeg_pictures_are_kept_as_they_are() -> None:
    config = CONFIG.replace("front: {", "front: {store: jpeg, ")
    made(config=config)
    kept = pyarrow.parquet.read_table("out/pictures/front/episode_000000.parquet")["jpeg"].to_pylist()
    assert kept == [jpeg(10 * n) for n in range(21)]

    assert dataset(["run.bag", "--config", "robot.yaml", "-o", "hdf5", "--format=hdf5"]) == 0
    with h5py.File("hdf5/data/episode_000000.hdf5") as file:
        assert [cell.tobytes() for cell in file["cameras/front/jpeg"]] == kept
        assert (file.attrs["task"], file["observations/joints"].attrs["unit"]) == ("lift the cup", "deg")
        assert file["observations/joints"][3].tolist() == pytest.approx([-1003, 1003])
        assert file["actions/base"][:, 0].tolist() == [n // 5 * 5 for n in range(21)]
        assert np.diff(file["time"][:]).tolist() == [10**8] * 20


def test_duckdb_and_pandas_read_the_data_set() -> None:
    made()
    sql = "SELECT count(*), max(\"actions.base\"[1]) FROM 'out/data/*.parquet'"
    assert duckdb.sql(sql).fetchall() == [(21, 20.0)]


def raw_image(time: float, level: int) -> Row:
    pixels = np.full((33, 49, 3), (level, 0, 0), np.uint8)  # blue is 0
    image = Image(height=33, width=49, encoding="rgb8", step=147, data=pixels.tobytes())
    return "/raw", image, *ns(time)


def test_raw_images_of_odd_size_become_videos() -> None:
    Path("run.bag").write_bytes(bag_bytes([raw_image(100 + n / 10, 200) for n in range(10)]))
    made(config="rate: 10\ntime: receipt\ncameras: {eye: {topic: /raw}}\n")

    with av.open("out/videos/eye/episode_000000.mp4") as video:
        frames = [frame.to_ndarray(format="rgb24") for frame in video.decode(video=0)]
    assert (len(frames), frames[0].shape) == (10, (32, 48, 3))
    assert frames[0].mean(axis=(0, 1)).tolist() == pytest.approx([200, 0, 0], abs=12)


def test_a_damaged_picture_is_replaced_and_reported() -> None:
    rows = [picture(100 + n / 10, b"\xff\xd8broken" if n in (0, 4) else jpeg(20 * n)) for n in range(10)]
    Path("run.bag").write_bytes(bag_bytes(rows))
    made(config="rate: 10\ncameras: {front: {topic: /camera/compressed}}\n")

    with av.open("out/videos/front/episode_000000.mp4") as video:
        levels = [float(frame.to_ndarray(format="gray").mean()) for frame in video.decode(video=0)]
    assert len(levels) == json.loads(Path("out/checks/episode_000000.json").read_text())["rows"]
    assert abs(levels[4] - levels[3]) < 3
    assert abs(levels[0] - levels[1]) < 3
    assert "2 pictures are damaged" in Path("out/report.md").read_text()


GAPPED = "rate: 10\ntime: receipt\ngaps: {}\nobservations: {{x: {{topic: /x}}, y: {{topic: /y}}}}\n"


def gapped() -> None:
    """Write a bag in which /y has no message from 1.0 to 1.6 s, and begins at 0.3 s."""
    rows: list[Row] = []
    for n in range(30):
        rows.append(("/x", Float64(n), *ns(100 + n / 10)))
        if n >= 3 and not 10 <= n < 16:
            rows.append(("/y", Float64(-n), *ns(100 + n / 10)))
    Path("run.bag").write_bytes(bag_bytes(rows))


def test_gaps_are_null_or_held() -> None:
    gapped()
    table = made(config=GAPPED.format("keep"))
    assert table.num_rows == 27  # the rows before the first message are cut
    y = [each[0] for each in table["observations.y"].to_pylist()]
    assert y[:7] == [-3, -4, -5, -6, -7, -8, -9]
    assert y[7:14] == [-9, *[None] * 5, -16]  # -9 is 0.1 s old, which is within the tolerance

    Path("robot.yaml").write_text(GAPPED.format("hold"))
    assert dataset(["run.bag", "--config", "robot.yaml", "-o", "held", "-j1"]) == 0
    held = pyarrow.parquet.read_table("held/data/episode_000000.parquet")["observations.y"].to_pylist()
    assert [each[0] for each in held][7:14] == [-9] * 6 + [-16]


def test_an_episode_with_gaps_is_left_out_and_reported(capsys: pytest.CaptureFixture[str]) -> None:
    gapped()
    Path("robot.yaml").write_text(GAPPED.format("skip"))
    assert dataset(["run.bag", "--config", "robot.yaml", "-o", "out", "-j1"]) == 1
    assert capsys.readouterr().out.startswith("0 of 1 episodes, 0 rows")
    text = Path("out/report.md").read_text()
    assert "left out: observations.y has no message within 0.1 s for 5 rows, the first at 1.10 s" in text
    assert not Path("out/data").exists()


def test_numbers_are_interpolated_between_messages_within_the_tolerance() -> None:
    rows: list[Row] = [
        ("/x", Float64(value), *ns(time)) for time, value in ((1, 10), (2, 20), (5, 50), (5.25, 60))
    ]
    Path("run.bag").write_bytes(bag_bytes(rows))
    config = (
        "rate: 4\ntolerance: 0.8\ngaps: keep\ntime: receipt\nobservations: {x: {topic: /x, pick: linear}}\n"
    )
    found = [row[0] for row in made(config=config)["observations.x"].to_pylist()]
    # From 2 to 5 s, the messages are too far apart: the nearest one counts, or none.
    assert found == [10, 12.5, 15, 17.5, 20, 20, 20, 20, *[None] * 5, 50, 50, 50, 50, 60]


@pytest.mark.parametrize(("pick", "first"), [("backward", 1), ("forward", 2), ("nearest", 2)])
def test_the_message_of_a_row_is_chosen(pick: str, first: int) -> None:
    """Rows are at 0.00, 0.25, …, messages at 0.0, 0.1, 0.3, …"""
    rows: list[Row] = [("/x", Float64(n), *ns(100 + at)) for n, at in enumerate((0, 0.1, 0.3, 0.5, 0.75, 1))]
    Path("run.bag").write_bytes(bag_bytes(rows))
    config = f"rate: 4\ntolerance: 1\ntime: receipt\nobservations: {{x: {{topic: /x, pick: {pick}}}}}\n"
    assert made(config=config)["observations.x"].to_pylist() == [[0], [first], [3], [4], [5]]


def test_stamps_out_of_order_are_left_out() -> None:
    rows = [joints(100 + n / 10) for n in range(20)]
    late = rows[5][1]
    late.header.stamp = Time(500, 0)  # one wrong stamp must not hide all that follow
    Path("run.bag").write_bytes(bag_bytes(rows))
    config = "rate: 10\ntolerance: 0.25\nobservations: {j: {topic: /joints, names: [a]}}\n"
    values = [each[0] for each in made(config=config)["observations.j"].to_pylist()]
    assert pytest.approx(100.5) not in values
    assert pytest.approx(101.8) in values
    found = json.loads(Path("out/checks/episode_000000.json").read_text())["findings"]
    assert [each["text"] for each in found if each["check"] == "clock"] == [
        "stamps jump by +399.500 s; stamps jump by -399.500 s"
    ]


def test_episodes_follow_bools_and_texts() -> None:
    rows: list[Row] = [("/x", Float64(n), *ns(100 + n / 10)) for n in range(60)]
    marks = {100.5: True, 101.5: False, 102: True, 103: True}
    rows += [("/mark", Bool(on), *ns(at)) for at, on in marks.items()]
    rows.append(("/task", String("first"), *ns(101)))
    rows.append(("/task", String("second"), *ns(102.5)))
    Path("run.bag").write_bytes(bag_bytes(sorted(rows, key=lambda row: row[2:])))
    made(config="rate: 10\ntime: receipt\nepisodes: {topic: /mark}\ntask: {topic: /task}\n"
         "observations: {x: {topic: /x}}\n")  # fmt: skip
    results = [json.loads(file.read_text()) for file in sorted(Path("out/checks").glob("*.json"))]
    assert [(each["start"] / 1e9, each["end"] / 1e9, each["task"]) for each in results] == [
        (100.5, 101.5, "first"), (102, 103, "second"), (103, 105.9, "second")
    ]  # fmt: skip


def test_an_interrupted_run_continues_and_equals_a_whole_one() -> None:
    names = [str(demonstration(Path(f"run{n}.bag"), 100.0 + n, seconds=1.0)) for n in range(6)]
    command = [*names, "--config", "robot.yaml", "-j2", "-o"]
    assert dataset([*command, "whole"]) == 0

    code = "import sys; from pipros_data.commands.dataset import main; sys.exit(main(sys.argv[1:]))"
    process = subprocess.Popen([sys.executable, "-c", code, *command, "out"], start_new_session=True)
    try:
        wait_until(lambda: list(Path("out/checks").glob("*.json")))
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    Path("out/checks/episode_000005.json").unlink(missing_ok=True)  # on a busy machine, it may be finished
    before = {file: file.stat().st_mtime_ns for file in Path("out/checks").glob("*.json")}
    Path("out/data").mkdir(exist_ok=True)
    Path("out/data/episode_000005.parquet.active").write_bytes(b"unfinished")
    assert dataset([*command, "out"]) == 0

    assert {file: file.stat().st_mtime_ns for file in before} == before
    for file in Path("whole").rglob("*.*"):
        assert (Path("out") / file.relative_to("whole")).read_bytes() == file.read_bytes()
    assert len(list(Path("out").rglob("*.*"))) == len(list(Path("whole").rglob("*.*")))


@pytest.mark.needs("blocked signals")
@pytest.mark.parametrize("delay_s", [0.05, 0.15])
def test_workers_that_are_starting_end_silently_on_ctrl_c(delay_s: float) -> None:
    code = "import sys; from pipros_tools.cli.pipros import main; sys.exit(main())"
    bags = [str(demonstration(Path(f"run{n}.bag"), 100.0 + n, seconds=1.0)) for n in range(2)]
    command = [sys.executable, "-c", code, "dataset", *bags, "--config", "robot.yaml", "-j2", "-o", "out"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True) as process:
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
        wait_until(lambda: len(children.read_text().split()) >= 3 or process.poll() is not None)
        time.sleep(delay_s)
        os.killpg(process.pid, signal.SIGINT)
        try:
            errors = process.communicate(timeout=30)[1]
        finally:
            process.kill()
    assert (process.returncode, errors) == (130, "")


def test_the_suggested_description_makes_a_data_set(capsys: pytest.CaptureFixture[str]) -> None:
    assert dataset(["run.bag", "--suggest"]) == 0
    text = capsys.readouterr().out
    assert "rate: 10  # rows per second" in text
    assert '  joints:\n    topic: "/joints"  # sensor_msgs/JointState, ' in text
    assert 'names: ["a", "b"]' in text
    assert text.index("actions:\n") < text.index('topic: "/cmd_vel"')
    table = made(config=text)
    assert table["actions.cmd_vel"].to_pylist()[0] == [0] * 6
    assert len(table["observations.joints"][0]) == 2
    assert Path("out/videos/camera/episode_000000.mp4").stat().st_size > 0


def test_rare_topics_do_not_decide_the_suggested_rate(capsys: pytest.CaptureFixture[str]) -> None:
    rows = [("/level", Float64(n), 100 + n // 20, n % 20 * 50_000_000) for n in range(100)]
    rows += [("/battery", Float64(n), 100 + n, 0) for n in range(5)]
    rows += [("/once", Float64(1), 100, 0), ("/text", String("x"), 100, 0)]
    rows += [("/episode", Bool(n % 2 == 0), 101 + n, 0) for n in range(2)]
    Path("run.bag").write_bytes(bag_bytes(sorted(rows, key=lambda row: row[2:])))
    assert dataset(["run.bag", "--suggest"]) == 0
    text = capsys.readouterr().out
    assert text.startswith("rate: 20  #")
    assert 'episodes: {topic: "/episode"}' in text
    assert text.endswith("# left out: /once (std_msgs/Float64), /text (std_msgs/String)\n")
    assert made(config=text)["observations.battery"].to_pylist()[0] == [1]


def test_an_episode_without_messages_of_a_topic_is_left_out(capsys: pytest.CaptureFixture[str]) -> None:
    rows = [("/level", Float64(n), 100 + n, 0) for n in range(20)]
    rows += [("/late", Imu(), 115, 0), ("/late", Imu(), 116, 0)]
    rows += [("/episode", Bool(n % 2 == 0), 101 + 5 * n, 1) for n in range(4)]
    Path("run.bag").write_bytes(bag_bytes(sorted(rows, key=lambda row: row[2:])))
    config = "rate: 1\ntime: receipt\ntolerance: 1\nepisodes: {topic: /episode}\n"
    config += "observations: {level: {topic: /level}, late: {topic: /late}}\n"
    Path("robot.yaml").write_text(config)
    assert dataset(["run.bag", "--config", "robot.yaml", "-o", "out", "-j1"]) == 0
    shown = capsys.readouterr()
    assert shown.out.startswith("1 of 2 episodes, ")
    assert shown.err.startswith("run.bag: left out: observations.late has no message within 1.0 s")


def test_a_picture_with_too_many_pixels_counts_as_damaged() -> None:
    huge = bytearray(jpeg(50))
    at = huge.index(b"\xff\xc0")
    huge[at + 5 : at + 9] = b"\xff\xff\xff\xff"  # height and width
    rows = [picture(100 + n / 10, bytes(huge) if n else jpeg(9)) for n in range(3)]
    Path("run.bag").write_bytes(bag_bytes(rows))
    made(config="rate: 10\ncameras: {front: {topic: /camera/compressed}}\n")
    assert "2 pictures are damaged" in Path("out/report.md").read_text()


def test_suggestions_read_counts_and_indexes_once_for_all_topics(monkeypatch: pytest.MonkeyPatch) -> None:
    asked, count, read = [], BagReader.count_by_connection, contents.read_chunk_index
    monkeypatch.setattr(BagReader, "count_by_connection", lambda bag: asked.append("counts") or count(bag))
    monkeypatch.setattr(contents, "read_chunk_index", lambda *each: asked.append("index") or read(*each))
    Path("run.bag").write_bytes(bag_bytes([(f"/x{n % 99}", Float64(n), n + 1, 0) for n in range(198)]))
    assert dataset(["run.bag", "--suggest"]) == 0
    assert sorted(asked) == ["counts", "index"]


def test_suggested_names_are_quoted(capsys: pytest.CaptureFixture[str]) -> None:
    state = JointState(name=["on", "a: [b"], position=[1.0, 2.0])
    state.header.stamp = Time(100, 0)
    topic = "/x\nrate: 9"
    Path("run.bag").write_bytes(bag_bytes([(topic, state, 100, 0), (topic, state, 100, 10**8)]))
    assert dataset(["run.bag", "--suggest"]) == 0
    text = capsys.readouterr().out
    table = made(config=text.replace("rate: 10", "rate: 1"))
    assert table["observations.x_rate_9"].to_pylist() == [[1, 2]]


@pytest.mark.parametrize("bad", [0, 1, 2])
@pytest.mark.parametrize("content", [b"no bag", b"version https://git-lfs.github.com/spec/v1\n"])
def test_a_bag_that_cannot_be_read_does_not_end_a_data_set(content: bytes, bad: int, capsys) -> None:
    bags = ["a.bag", "b.bag", "c.bag"]
    for number, name in enumerate(bags):
        rows = [("/level", Float64(n), 100 * number + n, 0) for n in range(20)]
        Path(name).write_bytes(content if number == bad else bag_bytes(rows))
    Path("robot.yaml").write_text(
        "rate: 1\ntime: receipt\ntolerance: 1\nobservations: {level: {topic: /level}}\n"
    )

    assert dataset([*bags, "--config", "robot.yaml", "-o", "out", "-j1"]) == 1

    shown = capsys.readouterr()
    assert shown.out.startswith("2 of 2 episodes, 40 rows, ")
    assert f"WARNING: {bags[bad]} is left out: {bags[bad]} is not a bag" in shown.err


WHOLE_SCAN = LaserScan(ranges=[1.0] * 10)


@pytest.mark.parametrize(("topic", "others", "odd", "rows", "named"), [
    ("/scan", WHOLE_SCAN, LaserScan(ranges=[1.0] * 9), 40, "/scan: an array has another size than most"),
    ("/scan", WHOLE_SCAN, LaserScan(), 40, ""),  # such as before the lidar turns
    ("/other", WHOLE_SCAN, WHOLE_SCAN, 20, "no bag has /scan"),
    ("/scan", String("x"), String("x"), 20, "std_msgs/String has no field 'ranges'"),
])  # fmt: skip
def test_an_odd_message_or_bag_does_not_end_a_data_set(
    topic: str, others: Any, odd: Any, rows: int, named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    strange = [(topic, odd if n == 7 else others, 100 + n, 0) for n in range(20)]
    usual = [("/scan", WHOLE_SCAN, 100 + n, 0) for n in range(20)]
    for name, sent in (("odd.bag", strange), ("run.bag", usual)):
        Path(name).write_bytes(bag_bytes(sent))
    Path("robot.yaml").write_text(
        "rate: 1\ntime: receipt\ntolerance: 1\nobservations: {scan: {topic: /scan, fields: [ranges]}}\n"
    )

    code = dataset(["odd.bag", "run.bag", "--config", "robot.yaml", "-o", "out", "-j1"])

    shown = capsys.readouterr()
    assert (code, named in shown.err, bool(shown.err)) == (1 if named else 0, True, bool(named))
    assert f", {rows} rows, " in shown.out


@pytest.mark.parametrize(("usual", "other", "named"), [
    (JointState(position=[1, 2]), [JointState(position=[1])], "its numbers are 1 in observations.x: posi"),
    (Twist(), [TwistStamped()], "its numbers are 6 in observations.x: twist.linear.x, "),
    (Float64(), [], "b.bag has no messages"),
])  # fmt: skip
def test_all_episodes_have_the_same_columns(
    usual: Any, other: list[Any], named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, sent in (("a.bag", [usual] * 9), ("b.bag", other * 9), ("c.bag", [usual] * 9)):
        Path(name).write_bytes(bag_bytes([("/x", message, 100 + n, 0) for n, message in enumerate(sent)]))
    Path("robot.yaml").write_text("rate: 1\ntime: receipt\nobservations: {x: {topic: /x}}\n")

    for _ in range(2):  # an interrupted command may be repeated
        assert dataset(["a.bag", "b.bag", "c.bag", "--config", "robot.yaml", "-o", "out", "-j1"]) == 1

        shown = capsys.readouterr()
        assert shown.out.startswith("2 of 2 episodes, 18 rows, ")
        assert shown.err.startswith(f"WARNING: b.bag is left out: {named}")
        assert len([*Path("out/data").iterdir()]) == 2


def test_stamps_of_another_clock_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    Path("run.bag").write_bytes(bag_bytes([("/x", JointState(position=[1]), 100 + n, 0) for n in range(9)]))
    Path("robot.yaml").write_text("rate: 1\nobservations: {x: {topic: /x}}\n")
    assert dataset(["run.bag", "--config", "robot.yaml", "-o", "out", "-j1"]) == 1
    assert "stamps of observations.x are -104.0 s from their receipt. Set time" in capsys.readouterr().err


def test_a_row_whose_message_has_a_rounded_stamp_is_not_lost() -> None:
    # the last one is 0.3 ns too early
    rows = [("/level", Float64(n), 100, int(n * 1e9 / 30)) for n in range(30)]
    Path("run.bag").write_bytes(bag_bytes(rows))
    Path("robot.yaml").write_text(
        "rate: 30\ntime: receipt\ntolerance: 1\nobservations: {level: {topic: /level}}\n"
    )

    assert dataset(["run.bag", "--config", "robot.yaml", "-o", "out", "-j1"]) == 0

    assert "| 30 |" in Path("out/report.md").read_text()


def raw(time: float, data: bytes, *, encoding: str = "rgb8", width: int = 16) -> Row:
    image = Image(height=16, width=width, encoding=encoding, step=3 * width, data=data)
    image.header.stamp = Time(*ns(time))
    return "/camera/raw", image, *ns(time + 0.02)


RAW = "rate: 10\ntolerance: 0.03\ngaps: keep\ncameras: {front: {topic: /camera/raw}}\n"
WHOLE = bytes(16 * 16 * 3)


@pytest.mark.parametrize("bad", [0, 7, 19])
@pytest.mark.parametrize(
    "damaged", [{"data": WHOLE[:-1]}, {"data": WHOLE, "encoding": "32FC1"}, {"data": b"", "width": 0}],
    ids=["short", "encoding", "empty"],
)  # fmt: skip
def test_an_unusable_raw_picture_is_a_gap_and_is_named(bad: int, damaged: dict[str, Any], capsys) -> None:
    rows: list[Row] = []
    for n in range(20):
        rows.append(raw(100 + n / 10, **(damaged if n == bad else {"data": WHOLE})))
    Path("run.bag").write_bytes(bag_bytes(rows))

    Path("robot.yaml").write_text(RAW)

    code = dataset(["run.bag", "--config", "robot.yaml", "-o", "out", "-j1"])

    assert code in (0, 1), capsys.readouterr().err
    table = pyarrow.parquet.read_table("out/data/episode_000000.parquet")
    gaps = table["cameras.front.is_gap"].to_pylist()
    assert sum(gaps) == (1 if bad == 7 else 0)  # incomplete rows at the ends are left out
    assert len(gaps) == (20 if bad == 7 else 19)
    assert "/camera/raw: " in Path("out/report.md").read_text()


def test_a_bag_without_a_usable_picture_leaves_the_others(capsys: pytest.CaptureFixture[str]) -> None:
    for name, data in (("run.bag", WHOLE), ("short.bag", WHOLE[:-1])):
        Path(name).write_bytes(bag_bytes([raw(100 + n / 10, data) for n in range(20)]))
    Path("robot.yaml").write_text(RAW)

    dataset(["short.bag", "run.bag", "--config", "robot.yaml", "-o", "out", "-j1"])

    assert "short.bag" in capsys.readouterr().err
    assert len(list(Path("out/data").glob("*.parquet"))) >= 1
    assert "run.bag" in Path("out/report.md").read_text()

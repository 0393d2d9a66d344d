"""rosmsg, rossrv and rosaction, beyond the transcripts of genuine ROS (tests.golden.cli)."""

import io
from pathlib import Path

import pytest

from pipros_tools.cli import rosaction, rosmsg, rossrv
from tests.support.environments import file_of_tests

BAG = file_of_tests("golden/messages/two_types.bag")


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package on ROS_PACKAGE_PATH."""
    folder = tmp_path / "src" / f"robot_{tmp_path.name}"  # types are cached for the life of the process
    (folder / "msg").mkdir(parents=True)
    (folder / "action").mkdir()
    (folder / "package.xml").write_text(
        f"<package><name>{folder.name}</name><version>0.0.0</version></package>"
    )
    (folder / "msg" / "Broken.msg").write_text("int32\nint32 good\nint32 a b")
    (folder / "action" / "Count.action").write_text("int32 to # here\n---\n---\nint32 at\n")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(folder.parent))
    return folder


def test_show_prints_the_definition_of_an_action(robot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert rosaction.main(["show", f"{robot.name}/Count"]) == 0
    assert rosaction.main(["show", "-r", f"{robot.name}/Count"]) == 0
    assert (
        capsys.readouterr().out == "int32 to\n---\n---\nint32 at\n\nint32 to # here\n---\n---\nint32 at\n\n"
    )


def test_actions_are_listed_and_so_are_their_messages(robot: Path, capsys) -> None:
    assert rosaction.main(["package", robot.name]) == 0
    assert capsys.readouterr().out == f"{robot.name}/Count\n"
    assert rosmsg.main(["package", "-s", robot.name]) == 0
    listed = capsys.readouterr().out.split()
    assert f"{robot.name}/CountActionGoal" in listed
    assert f"{robot.name}/Broken" in listed


def test_actions_have_the_md5_of_the_message_that_binds_them(capsys: pytest.CaptureFixture[str]) -> None:
    assert rosaction.main(["md5", "actionlib_tutorials/Fibonacci"]) == 0
    assert capsys.readouterr().out == "f59df5767bf7634684781c92598b2406\n"


def test_definitions_without_end_are_refused(robot: Path, capsys: pytest.CaptureFixture[str]) -> None:
    texts = {"Self": "Self a", "D0": "int8 a", **{f"D{i + 1}": f"D{i} a\nD{i} b" for i in range(30)}}
    for name, text in texts.items():
        (robot / "msg" / f"{name}.msg").write_text(text)
    assert [rosmsg.main(["show", f"{robot.name}/{name}"]) for name in ("Self", "D30", "D3")] == [1, 1, 0]
    errors = capsys.readouterr().err.splitlines()
    assert ["contain itself" in errors[0], "fields in total" in errors[1]] == [True, True]


def test_all_mistakes_of_a_definition_are_reported_at_once(robot: Path, capsys) -> None:
    assert rosmsg.main(["show", f"{robot.name}/Broken"]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert [line.partition(".msg:")[2][:3] for line in lines] == ["1:1", "3:1"]
    assert lines[0].startswith(f"Unable to load msg [{robot.name}/Broken]: {robot}/msg/Broken.msg")


def test_an_unknown_package_is_reported_with_the_places_that_were_searched(robot: Path, capsys) -> None:
    assert rossrv.main(["package", "no_such_package"]) == 64
    errors = capsys.readouterr().err.splitlines()
    assert errors[:2] == ["Invalid package: no_such_package", f"ROS path [0]={robot.parent}"]
    advice = f"ROS_PACKAGE_PATH is {robot.parent}; is devel/setup.bash of its workspace sourced?\n"
    for name, beginning in (
        ("no_such/X", "Unable to load msg [no_such/X]: there is no package no_such: "),
        ("NoSuchType", "Could not find msg 'NoSuchType'\n"),
    ):
        assert (rosmsg.main(["show", name]), capsys.readouterr().err) == (1, beginning + advice)
    assert rossrv.main(["md5", "SetBol"]) == 0
    assert capsys.readouterr().err == "No messages matching the name [SetBol]\nDid you mean SetBool?\n"
    for subcommand in ("show", "md5", "package"):
        with pytest.raises(SystemExit):
            rossrv.main([subcommand, "a", "b"])
        assert capsys.readouterr().err.endswith("error: you may only specify one service type\n")


def test_lists_are_sorted_and_complete(capsys: pytest.CaptureFixture[str]) -> None:
    assert rosmsg.main(["packages", "-s"]) == 0
    packages = capsys.readouterr().out.split()
    assert packages == sorted(packages)
    assert {"actionlib", "std_msgs", "sensor_msgs"} <= set(packages)
    assert "std_srvs" not in packages
    assert rosmsg.main(["list"]) == 0
    types = capsys.readouterr().out.split()
    assert {"std_msgs/String", "actionlib/TestActionGoal"} <= set(types)


def test_a_bag_shows_types_as_their_publishers_defined_them(capsys: pytest.CaptureFixture[str]) -> None:
    assert rosmsg.main(["show", "-b", str(BAG), "std_msgs/String"]) == 0
    assert capsys.readouterr().out == "string data\n\n"
    assert rosmsg.main(["show", "--bag", str(BAG), "nav_msgs/Path"]) == 0
    assert "  geometry_msgs/Pose pose\n    geometry_msgs/Point position\n" in capsys.readouterr().out
    assert rosmsg.main(["show", "-b", str(BAG), "std_msgs/Int8"]) == 1


@pytest.mark.parametrize(("content", "words"), [
    (b"not a bag", "is not a bag"),
    (b"#ROSBAG V2.0\n", "Run rosbag reindex"),
    (b"#ROSBAG V2.0\n\xff\xff\xff\xff", "Run rosbag reindex"),
    (BAG.read_bytes()[:200], "ends before its index"),
    (BAG.read_bytes().replace(b"string data", b"String data"), "a message cannot contain itself"),
    (BAG.read_bytes().replace(b"string data", b"Absent data"), "unknown type [std_msgs/Absent]"),
])  # fmt: skip
def test_a_bag_that_is_not_whole_is_refused(content: bytes, words: str, tmp_path: Path, capsys) -> None:
    bag = tmp_path / "x.bag"
    bag.write_bytes(content)
    assert rosmsg.main(["show", "-b", str(bag), "std_msgs/String"]) == 1
    assert words in capsys.readouterr().err


def test_a_missing_type_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    with pytest.raises(SystemExit) as caught:
        rosmsg.main(["show"])
    assert caught.value.code == 2

from __future__ import annotations

from pathlib import Path

import pytest
from std_msgs.msg import Header, Int32

from pipros_tools.cli import rostopic
from tests.support.bags import bag_bytes


@pytest.fixture
def bag(tmp_path: Path) -> str:
    path = tmp_path / "run.bag"
    rows = [("/a", Int32(n), n, 5) for n in range(4)]
    path.write_bytes(bag_bytes([*rows, ("/deep/h", Header(frame_id="map"), 4, 0)]))
    return str(path)


@pytest.mark.parametrize(("arguments", "out"), [
    (["/a", "-n", "2"], "data: 0\n---\ndata: 1\n---\n"), (["a/data", "-n", "1"], "0\n---\n"),
    (["/deep/h/frame_id"], '"map"\n---\n'),
    (["-p", "/a", "-n", "2"], "%time,field.data\n5,0\n1000000005,1\n"),
    (["-p", "/deep/h"], "%time,field.seq,field.stamp,field.frame_id\n4000000000,0,0,map\n"),
    (["-p", "/deep/h", "--nostr"], "%time,field.seq,field.stamp\n4000000000,0,0\n"),
    (["-p", "/deep/h/frame_id", "--nostr"], "%time,field\n4000000000,map\n"),
    (["--filter", "m.data == 3", "/a"], "data: 3\n---\n"), (["-a", "-n", "1"], "data: 0\n---\n"),
    (["/none"], ""),
])  # fmt: skip
def test_echo_shows_the_messages_of_a_bag(
    arguments: list[str], out: str, bag: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert (rostopic.main(["echo", "-b", bag, *arguments]), capsys.readouterr().out) == (0, out)


def test_list_shows_the_topics_of_a_bag(bag: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert (rostopic.main(["list", "-b", bag]), capsys.readouterr().out) == (0, "/a\n/deep/h\n")
    assert rostopic.main(["list", "-b", bag, "/a"]) == 0
    assert capsys.readouterr().out.startswith(
        ("4 message(s) from 01 Jan 1970 ", "4 message(s) from 31 Dec 1969 ")  # depends on the time zone
    )


@pytest.mark.parametrize(
    ("content", "words"),
    [(None, "does not exist"), (b"x", "unable to use bag file: "), (b"#ROSBAG V2.0\n", "Unindexed bag")],
)
def test_a_file_that_is_not_a_bag_is_refused(
    content: bytes | None, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "x.bag"
    if content is not None:
        path.write_bytes(content)
    for command in (["echo", "-b", str(path), "/a"], ["list", "-b", str(path)]):
        assert rostopic.main(command) == 1
        assert words in capsys.readouterr().err


def test_offsets_from_now_are_not_applied_to_a_bag(bag: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        rostopic.main(["echo", "-b", bag, "--offset", "/a"])
    assert "offset time option is not valid with bag files" in capsys.readouterr().err

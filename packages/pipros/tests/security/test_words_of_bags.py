"""Strings of a bag on terminals: one line each, without escape sequences; exports stay in their folder."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import Any

import pytest
import yaml
from sensor_msgs.msg import CompressedImage
from std_msgs.msg import Int32, String

from pipros_tools.bag import BagReader, BagWriter
from pipros_tools.bag.info import bag_info
from pipros_tools.bag.info_text import info_text, info_yaml
from pipros_tools.cli import rostopic
from pipros_tools.cli.rosbag import main
from tests.support.bags import bag_bytes, header_of

HOSTILE = "\x1b]0;OWNED\x07\nforged: line\u202e"
WRITTEN_OUT = r"\x1b]0;OWNED\x07\nforged: line\u202e"


@pytest.fixture
def bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A bag with control characters in every string."""
    monkeypatch.chdir(tmp_path)
    file = io.BytesIO()
    writer = BagWriter(file)
    header = header_of(String(), "/a", callerid="/x" + HOSTILE)
    for n in range(3):
        names = {"topic": "/t" + HOSTILE, "type": "evil/T" + HOSTILE, "md5sum": f"{n}" + HOSTILE}
        changed = header | {key: value.encode() for key, value in names.items()}
        connection = writer.add_connection("/t" + HOSTILE if n < 2 else "/ok", changed)
        writer.write_message(connection, 1 + n, 0, String(HOSTILE))
    known = header | {"md5sum": HOSTILE.encode(), "message_definition": b"int32 data"}
    writer.write_message(writer.add_connection("/known", known), 8, 0, Int32(1))
    connection = writer.add_connection("/said", header)
    writer.write_message(connection, 9, 0, String(HOSTILE))
    writer.finish()
    path = tmp_path / "x.bag"
    path.write_bytes(file.getvalue())
    Path("packed.bag").write_bytes(file.getvalue().replace(b"compression=none", b"compression=\x1b[3m"))
    return path


@pytest.mark.parametrize(
    "line",
    [
        "info x.bag",
        "info --freq x.bag",
        "info -y x.bag",
        "info -y --freq x.bag",
        "info -y -k topics x.bag",
        "info -y -k types[0].md5 x.bag",
        "info packed.bag",
        "info -y packed.bag",
        "info -y -k compression packed.bag",
        "check x.bag",
        "check -g rules.bmr x.bag",
        "fix x.bag fixed.bag",
        "fix --force x.bag fixed.bag",
        "export x.bag out",
        "export packed.bag out",
        "filter --print=topic x.bag some.bag True",
        "filter --print=m.data x.bag some.bag topic=='/said'",
        "compress -f x.bag",
        "compress -f packed.bag",
        "reindex -f packed.bag",
        "convert x.bag x.mcap",
    ],
)
def test_commands_escape_strings_of_a_bag(line: str, bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(line.split())

    taken = capsys.readouterr()
    assert_plain(taken.out + taken.err)


@pytest.mark.parametrize("line", ["list -b x.bag", "echo -b x.bag -p /said", "echo -b x.bag -a"])
def test_rostopic_escapes_strings_of_a_bag(line: str, bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rostopic.main(line.split())

    taken = capsys.readouterr()
    assert_plain(taken.out + taken.err)


def assert_plain(text: str) -> None:
    assert "Traceback" not in text
    for line in text.replace("\r", "\n").split("\n"):
        assert line.replace("\t", "").isprintable(), repr(line)
        assert not line.startswith("forged"), text


def test_the_yaml_of_info_is_what_the_bag_has(bag: Path) -> None:
    with BagReader(bag) as reader:
        info = bag_info(reader, "x.bag")
    found = yaml.safe_load(info_yaml(info))

    assert [each["topic"] for each in found["topics"]] == ["/known", "/ok", "/said", "/t" + WRITTEN_OUT]
    assert found["types"][0] == {"type": "evil/T" + WRITTEN_OUT, "md5": "0" + WRITTEN_OUT}
    assert f"/t{WRITTEN_OUT}   2 msgs" in info_text(info)


@pytest.mark.parametrize(
    "topic", ["/../", "/..", "/../../x", "/a/../../b", "..", "/", "", "~/x", "/a\0b", "/a\nb", "C:\\x"]
)
def test_a_topic_that_is_a_path_is_not_exported(
    topic: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("x.bag").write_bytes(
        bag_bytes([(topic, CompressedImage(data=b"\xff\xd8"), 5, 0), ("/b", Int32(1), 5, 0)])
    )

    assert main(["export", "x.bag", "deep/out"]) == 1
    assert "is not a legal topic name" in capsys.readouterr().err
    assert sorted(os.listdir()) == ["deep", "x.bag"]
    assert os.listdir("deep") == ["out"]
    assert os.listdir("deep/out") == ["b.csv"]


def test_each_topic_and_each_image_is_exported_to_its_own_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    topics = ["/a/b", "/a_b", "/a__b", "/A/b", "/a/b/", "/a__b_2", "a/b"]
    rows: list[Any] = [(topic, Int32(n), 1, 0) for n, topic in enumerate(topics)]
    rows += [("/image", CompressedImage(data=b"\xff\xd8%d\xff\xd9" % n), 5, 0) for n in range(2)]
    Path("x.bag").write_bytes(bag_bytes(rows))

    assert main(["export", "x.bag", "out"]) == 0

    tables = {path.name: path.read_text().split(",")[-1].strip() for path in Path("out").glob("*.csv")}
    assert sorted(tables.values()) == sorted(str(n) for n in range(len(topics)))
    assert tables["A__b.csv"] == "3"
    assert len({name.lower() for name in tables}) == len(topics)
    assert sorted(path.name for path in Path("out/image").iterdir()) == [
        "5.000000000.jpg",
        "5.000000000_2.jpg",
    ]

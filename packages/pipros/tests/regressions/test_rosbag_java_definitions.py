"""rosjava, roslibpy: recorded definitions lack std_msgs/Header, so that tools refuse the topic or the bag."""

from __future__ import annotations

from pathlib import Path

import pytest
from sensor_msgs.msg import Imu

from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.language.digest import SEPARATOR
from pipros_tools.bag import BagWriter
from pipros_tools.cli.rosbag import main
from tests.support.bags import header_of


def test_a_type_without_the_definition_of_its_header_is_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    header = Imu._full_text[Imu._full_text.index(SEPARATOR) :].split(SEPARATOR)[1]
    text = "Header header\nint32 level\n"
    made = message_classes_from_text("own/Level", f"{text}{SEPARATOR}{header}")["own/Level"]
    with open("run.bag", "w+b") as file:
        writer = BagWriter(file)
        fields = {**header_of(made(), "/level"), "message_definition": text.encode()}
        connection = writer.add_connection("/level", fields)
        writer.write_message(connection, 5, 0, made(level=7))
        writer.finish()

    assert main(["table", "run.bag", "/level", "-o", "level.csv"]) == 0
    assert main(["export", "run.bag", "out"]) == 0
    assert Path("level.csv").read_text().splitlines()[1].endswith(",7")
    assert Path("out/level.csv").read_text().splitlines()[1].endswith(",7")
    assert main(["filter", "run.bag", "few.bag", "m.level == 7"]) == 0
    assert capsys.readouterr().err == ""

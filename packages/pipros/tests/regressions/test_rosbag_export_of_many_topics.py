"""rosbag: exporting a bag took a pass over the whole bag for each topic, hours for long recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import Int32

from pipros_tools.bag import contents
from pipros_tools.cli.rosbag import main
from tests.support.bags import bag_bytes


@pytest.mark.parametrize("topics", [3, 300])
def test_each_chunk_is_read_once(topics: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    rows: list[Any] = [(f"/t{number % topics}", Int32(number), number, 0) for number in range(600)]
    Path("run.bag").write_bytes(bag_bytes(rows, chunk_bytes=5000))
    reads: list[int] = []
    read_chunk_index = contents.read_chunk_index

    def counted(*arguments: Any) -> Any:
        reads.append(arguments[2].position)
        return read_chunk_index(*arguments)

    monkeypatch.setattr(contents, "read_chunk_index", counted)
    assert main(["export", "run.bag", "out"]) == 0

    assert len(set(reads)) > 3
    assert len(reads) == len(set(reads))
    assert [len(path.read_text().splitlines()) for path in Path("out").iterdir()] == [
        600 // topics + 1
    ] * topics

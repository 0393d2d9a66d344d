"""Log entries read from the log file of a run."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipros_tools.launch.log_history import FILE_BYTES, log_history

RUN = "0fb2803c-e4ea-11f1"
GENUINE = "1.5  WARN /arm [/ws/arm.py:7(move)] [topics: /rosout, /a] slow"


def history(folder: Path, text: str, run_id: object = RUN) -> list[list[object]]:
    (folder / RUN).mkdir()
    (folder / RUN / "rosout.log").write_text(text)
    return log_history(folder, run_id, 100, 100)


def test_lines_become_entries(tmp_path: Path) -> None:
    text = f"1.0 Node Startup\n{GENUINE}\n2.000000001 ERROR /b [x.cpp:1(f)] [topics: ] two\n\tlines\n"
    assert history(tmp_path, text) == [
        [4, "/arm", "slow", 1.5, "/ws/arm.py", 7, "move"],
        [8, "/b", "two\nlines", 2.0, "x.cpp", 1, "f"],
    ]


def test_only_the_end_of_a_large_file_is_read(tmp_path: Path) -> None:
    found = history(tmp_path, f"{GENUINE} {'x' * 90}\n" * (FILE_BYTES // 100))
    assert 0 < len(found) <= FILE_BYTES // (len(GENUINE) + 92)
    assert all(len(str(entry[2])) <= 100 for entry in found)


@pytest.mark.parametrize("run_id", ["../x", "", 7, "other"])
def test_a_run_without_a_file_has_no_history(tmp_path: Path, run_id: object) -> None:
    assert history(tmp_path, f"{GENUINE}\n", run_id) == []

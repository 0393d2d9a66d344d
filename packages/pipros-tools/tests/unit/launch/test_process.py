from __future__ import annotations

from pathlib import Path

from pipros_tools.launch.process import last_lines


def test_the_last_lines_of_a_file_are_not_blank(tmp_path: Path) -> None:
    file = tmp_path / "log"
    file.write_text("x" * 10_000 + "\n" + "\n".join(f"line {number}" for number in range(9)) + "\n\n \n")
    assert (last_lines(file, 2), last_lines(tmp_path / "none")) == (["line 7", "line 8"], [])

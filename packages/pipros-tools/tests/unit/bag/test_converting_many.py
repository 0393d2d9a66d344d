"""`rosbag convert --output-dir`: many bags, again after an interruption."""

# needs the plugins: ros2

import os
import re
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import Int32

from pipros_rosbag2.bags.reader import open_any_bag
from pipros_tools.cli.rosbag import main
from pipros_tools.cli.rosbag.progress import Progress
from tests.support.bags import bag_bytes

FORMS = {"mcap": [], "ros2": ["--ros2", "jazzy"]}


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def write_bags(count: int) -> list[str]:
    for number in range(count):
        rows: list[Any] = [("/a", Int32(10 * number + n), n + 1, 0) for n in range(5)]
        Path(f"run{number}.bag").write_bytes(bag_bytes(rows))
    return [f"run{number}.bag" for number in range(count)]


def values(path: Path) -> list[int]:
    with open_any_bag(path) as bag:
        return [each.message.data for each in bag]


def made() -> dict[str, list[int]]:
    return {path.stem: values(path) for path in sorted(Path("out").iterdir())}


EXPECTED = {f"run{number}": [10 * number + n for n in range(5)] for number in range(4)}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("jobs", [1, 2])
def test_a_repeated_run_converts_what_is_missing_or_unfinished(form: str, jobs: int, capsys) -> None:
    names = write_bags(4)
    command = ["convert", "--output-dir", "out", "--jobs", str(jobs), *FORMS[form]]
    assert main([*command, *names[:2]]) == 0
    assert re.fullmatch(
        r"2 of 2 bags converted: [\d.]+ KB in \d+ s, [\d.]+ [KM]B/s\n", capsys.readouterr().out
    )
    first = Path("out/run0.mcap" if form == "mcap" else "out/run0/run0_0.mcap")
    second = Path("out/run1.mcap" if form == "mcap" else "out/run1/run1_0.mcap")
    before = first.stat().st_mtime_ns
    second.write_bytes(second.read_bytes()[:-100])
    active = Path("out/run2.mcap.active" if form == "mcap" else "out/run2.active/run2_0.mcap")
    active.parent.mkdir(exist_ok=True)
    active.write_bytes(b"unfinished")

    assert main([*command, *names]) == 0

    assert (made(), first.stat().st_mtime_ns) == (EXPECTED, before)
    assert "3 of 4 bags converted: " in (out := capsys.readouterr().out)
    assert out.endswith("; 1 skipped, because they are complete\n")
    assert main([*command, "-f", "-q", *names]) == 0
    assert first.stat().st_mtime_ns > before
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_failures_affect_no_other_bag(jobs: str, capsys: pytest.CaptureFixture[str]) -> None:
    names = write_bags(4)
    Path("run0.bag").write_bytes(b"#ROSBAG V2.0\n")
    Path("b").mkdir()
    Path("b/run1.bag").write_bytes(Path("run2.bag").read_bytes())
    Path("out").mkdir()
    rows: list[Any] = [("/a", Int32(n), n + 90, 0) for n in range(9)]
    Path("x.bag").write_bytes(bag_bytes(rows))
    assert main(["convert", "x.bag", "out/run3.mcap"]) == 0

    assert main(["convert", "--output-dir", "out", "--jobs", jobs, *names, "b/run1.bag", "none.bag"]) == 1

    shown = capsys.readouterr()
    assert sorted(os.listdir("out")) == ["run1.mcap", "run2.mcap", "run3.mcap"]
    assert [values(Path(f"out/run{n}.mcap")) for n in (1, 2)] == [EXPECTED["run1"], EXPECTED["run2"]]
    assert "2 of 6 bags converted: " in shown.out
    assert shown.out.endswith("; 4 failed\n")
    errors = sorted(shown.err.splitlines())
    assert len(errors) == 4
    for error, part in zip(
        errors,
        [
            "b/run1.bag: out/run1.mcap would also be the output of run1.bag",
            "none.bag: ",
            "run0.bag: ",
            "run3.bag: out/run3.mcap already exists, with other messages; --force overwrites it",
        ],
        strict=True,
    ):
        assert error.startswith(f"ERROR converting {part}")


def test_the_progress_of_all_bags_is_shown_on_a_terminal_only(monkeypatch, capsys) -> None:
    names = write_bags(3)
    shown: list[tuple[int, int]] = []
    monkeypatch.setattr(Progress, "_show", lambda self, done, _: shown.append((done, self._total)))
    monkeypatch.setattr("pipros_tools.cli.rosbag.progress._PERIOD_S", 0.0)
    command = ["convert", "--output-dir", "out", "--jobs", "1", "-f", *names]

    assert (main(command), shown) == (0, [])
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    assert main(command) == 0

    total = sum(Path(name).stat().st_size for name in names)
    assert {size for _, size in shown} == {total}
    assert [done for done, _ in shown] == sorted(done for done, _ in shown)
    assert shown[-1][0] == total
    assert len(shown) > 9


def test_an_invalid_number_of_processes_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["convert", "--output-dir", "out", "--jobs", "0", "run.bag"])
    assert "--jobs must be >= 1, got 0" in capsys.readouterr().err

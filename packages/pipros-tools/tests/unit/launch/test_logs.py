from pathlib import Path

import pytest

from pipros.basics.env import Environment
from pipros_tools.launch.log_history import FILE_BYTES, log_history
from pipros_tools.launch.logs import LogFolder, disk_usage_report


def test_each_run_has_a_log_folder_and_latest_points_to_the_newest(tmp_path: Path) -> None:
    environment = Environment(log_dir=tmp_path / "log")
    LogFolder.of_run(environment, "one")
    second = LogFolder.of_run(environment, "two")
    assert (tmp_path / "log" / "latest").resolve() == second.path
    assert second.stem("g/h/n-2") == str(tmp_path / "log" / "two" / "g-h-n-2")
    assert second.is_usable
    assert list(second.path.iterdir()) == []


def test_a_log_folder_that_cannot_be_made_is_reported_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    environment = Environment(log_dir=tmp_path / "file" / "log")
    assert [LogFolder.of_run(environment, "run").is_usable for _ in range(2)] == [False, False]
    assert capsys.readouterr().err.count("set ROS_LOG_DIR to a writable location") == 1


def test_a_large_log_folder_is_warned_about(tmp_path: Path) -> None:
    assert disk_usage_report(tmp_path) == "Done checking log file disk usage. Usage is <1GB."
    with (tmp_path / "large").open("wb") as file:
        file.truncate(1_000_000_001)
    assert disk_usage_report(tmp_path).startswith(f"WARNING: disk usage in log directory [{tmp_path}]")


@pytest.mark.parametrize(
    ("files", "end"), [(1, "Usage is <1GB."), (200, "There are too many files to measure it quickly.")]
)
def test_few_log_files_are_measured_on_a_busy_machine_too(tmp_path: Path, files: int, end: str) -> None:
    is_over_at_once = -1.0
    for number in range(files):
        (tmp_path / str(number)).touch()
    assert disk_usage_report(tmp_path, is_over_at_once) == f"Done checking log file disk usage. {end}"


# Log entries read from the log file of a run.


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

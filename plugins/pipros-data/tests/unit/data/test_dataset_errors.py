"""`pipros dataset`: errors and limits."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from pipros.basics.errors import MissingExtra
from pipros.basics.limits import Limits
from pipros_data.commands.dataset import main as dataset
from pipros_data.extras import missing_extra, user_library
from tests.unit.data.demonstrations import CONFIG, demonstration, failure, made


@pytest.fixture(autouse=True)
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("robot.yaml").write_text(CONFIG)
    demonstration(Path("run.bag"), 100.0)


def test_another_description_needs_another_folder(capsys: pytest.CaptureFixture[str]) -> None:
    made()
    Path("robot.yaml").write_text(CONFIG.replace("rate: 10", "rate: 5"))
    assert dataset(["run.bag", "--config", "robot.yaml", "-o", "out"]) == 1
    assert "in out has a different rate and config_sha256. Choose a new" in capsys.readouterr().err
    Path("full").mkdir()
    Path("full/mine.txt").write_text("keep")
    assert dataset(["run.bag", "--config", "robot.yaml", "-o", "full"]) == 1
    assert "full contains other files" in capsys.readouterr().err
    assert [path.name for path in Path("full").iterdir()] == ["mine.txt"]


@pytest.mark.parametrize("text", ["[]", "{", "[" * 100_000])
def test_a_damaged_data_set_needs_another_folder(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("out").mkdir()
    Path("out/dataset.json").write_text(text)

    assert dataset(["run.bag", "--config", "robot.yaml", "-o", "out"]) == 1

    assert re.search(r"out/dataset\.json is damaged: .*\. Choose a new folder", capsys.readouterr().err)


@pytest.mark.parametrize(("old", "new", "reason"), [
    ("rate: 10\n", "", "bad.yaml: rate: is missing"),
    ("rate: 10", "rate: fast", "rate: must be a number from 0.001 to 10000, got 'fast'"),
    ("scale: 10", "scale: 0", "observations.joints.scale: must not be 0"),
    ("rate: 10", "rat: 10", "bad.yaml:1: rat: unknown key. Did you mean rate?"),
    ("names: [b, a]", "name: [b, a]", "joints.name: unknown key. Did you mean names"),
    ("names: [b, a]", "names: [b, c]", "left out: observations.joints has no"),
    ("max: [1000, 1000]", "max: -1000", "joints.min: must be < max, got"),
    ("max: [1000, 1000]", "max: [1, 2, 3]", "joints.max: must be one number or 2, got 3"),
    ("topic: /joints", "topic: /jonts", "joints.topic: no bag has /jonts. Did you mean /joints"),
    ("fields: [linear.x, ", "fields: [linear.w, ", "9: actions.base.fields: geometry_msgs/Twist has no"),
    (", time: receipt", "", "9: actions.base: geometry_msgs/Twist has no header. Add time"),
    ("topic: /episode", "topic: /joints", "must be std_msgs/String or std_msgs/Bool, got sensor"),
    ("{topic: /episode}", "once", "episodes: must be file, {topic: …} or {service: …}, got 'once'"),
    ("front: {topic: /camera/compressed}", "front: {topic: /joints}", "front.topic: must be sensor_msgs"),
    ("tolerance: 0.15", "tolerance: -1", "bad.yaml:2: tolerance: must be a finite number >= 0, got -1"),
    ("observations:\n", "observations: [\n", "invalid YAML"),
    ("actions:\n", "checks: {frosen: 1}\nactions:\n", "8: checks.frosen: unknown key. Did you mean fro"),
])  # fmt: skip
def test_errors_name_the_line_and_the_key(old: str, new: str, reason: str, capsys) -> None:
    assert old in CONFIG
    config = CONFIG.replace(old, new)
    if reason.startswith("left out"):
        Path("bad.yaml").write_text(config)
        assert dataset(["run.bag", "--config", "bad.yaml", "-o", "bad", "-j1"]) == 1
        assert reason in Path("bad/report.md").read_text()
        assert f"run.bag: {reason}" in capsys.readouterr().err
    else:
        demonstration(Path("other.bag"), 200.0)
        assert reason in failure(capsys, config)
        assert reason in failure(capsys, config, "other.bag")


def test_missing_files_are_named_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert dataset(["run.bag", "--config", "no.yaml", "-o", "out"]) == 1
    assert capsys.readouterr().err == "pipros dataset: cannot read no.yaml: No such file or directory\n"
    assert dataset(["no*.bag", "--config", "robot.yaml", "-o", "out"]) == 1
    assert capsys.readouterr().err == "pipros dataset: no such file: no*.bag\n"
    Path("run.bag").write_bytes(b"#ROSBAG V2.0\n")
    assert dataset(["run.bag", "--config", "robot.yaml", "-o", "out"]) == 1
    assert capsys.readouterr().err.startswith("pipros dataset: run.bag")


@pytest.mark.parametrize(("library", "kind"), [("h5py", "hdf5"), ("av", "parquet"), ("lerobot", "lerobot")])
def test_a_missing_library_is_named_in_one_line(library: str, kind: str) -> None:
    code = f"import sys; sys.modules[{library!r}] = None; "
    code += "from pipros_data.commands.dataset import main; sys.exit(main(sys.argv[1:]))"
    command = ["run.bag", "--config", "robot.yaml", "-o", "out", "--format", kind]
    ended = subprocess.run(
        [sys.executable, "-c", code, *command], capture_output=True, text=True, check=False
    )
    assert (ended.returncode, ended.stdout) == (1, "")
    assert f"needs {library}, which is not installed. Try: " in ended.stderr
    assert len(ended.stderr.splitlines()) == 1


@pytest.mark.parametrize(("files", "name", "text"), [
    ({}, "robots", "needs robots, which is not installed. Try: pip install robots"),
    ({}, "robots.arm", "needs robots, which is not installed. Try: pip install robots"),
    (
        {"__init__": ""},
        "robots.arm.left",
        "needs robots.arm, which the installed robots lacks. Try: pip install --upgrade robots",
    ),
    (
        {"__init__": "", "arm": "\nimport absent_library.part"},
        "robots.arm",
        "needs robots, which cannot be imported: ModuleNotFoundError: No module named 'absent_library' "
        "(arm.py:2). Try: pip install absent_library",
    ),
    (
        {"__init__": "from json import absent_name"},
        "robots",
        "needs robots, which cannot be imported: ImportError: cannot import name 'absent_name' from "
        "'json' (__init__.py:1)",
    ),
    (
        {"__init__": "", "arm": "\n1 +"},
        "robots.arm",
        "needs robots, which cannot be imported: SyntaxError: invalid syntax (arm.py, line 2) (arm.py:2)",
    ),
    (
        {"__init__": "\n\nint('x')"},
        "robots.arm",
        "needs robots, which cannot be imported: ValueError: invalid literal for int() with base 10: 'x' "
        "(__init__.py:3)",
    ),
])  # fmt: skip
def test_a_library_that_cannot_be_imported_is_told_apart_from_a_missing_one(
    files: dict[str, str], name: str, text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "lib" / "robots").mkdir(parents=True)
    for file, content in files.items():
        (tmp_path / "lib" / "robots" / f"{file}.py").write_text(content)
    if not files:
        (tmp_path / "lib" / "robots").rmdir()
    monkeypatch.syspath_prepend(tmp_path / "lib")
    for each in [each for each in sys.modules if each.partition(".")[0] == "robots"]:
        monkeypatch.delitem(sys.modules, each)

    with pytest.raises(MissingExtra) as error:
        user_library(name, "the test")

    shown = str(error.value).replace(f"{tmp_path / 'lib' / 'robots'}{os.sep}", "")
    assert re.sub(r" \(/[^)]*/json/__init__\.py\)", "", shown) == f"the test {text}"


def test_an_extra_that_cannot_be_imported_is_not_called_missing() -> None:
    broken = ImportError("libx.so: cannot open shared object file", name="pyarrow._lib")
    assert "needs pyarrow._lib, which cannot be imported: libx.so: cannot open" in str(
        missing_extra(broken, "Parquet")
    )


@pytest.mark.parametrize(("module", "limit", "error"), [
    ("rows", "dataset_rows=20", "the episode has 21 rows: the limit is 20 (dataset_rows"),
    ("signals", "table_bytes=300", "observations.joints: the episode is too large: the limit is 300"),
])  # fmt: skip
def test_an_episode_with_too_many_rows_or_numbers_is_an_error(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, module: str, limit: str, error: str
) -> None:
    limits = Limits.parse(limit)
    monkeypatch.setattr(f"pipros_data.datasets.{module}.process_limits", lambda: limits)
    assert error in failure(capsys, CONFIG)

"""`.cfg` files without a build."""

import importlib
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from dynamic_reconfigure.encoding import (
    Config,
    decode_config,
    decode_description,
    encode_config,
    encode_description,
)
from pipros.msg.importing.hook import PackageFinder
from pipros.packages import cache_folder
from pipros_libraries.reconfigure import cache
from pipros_libraries.reconfigure.cfg_file import BadConfigFile, find, module_contents, read
from pipros_libraries.reconfigure.generator import ParameterGenerator
from tests.support.waiting import wait_until

HEAD = "from dynamic_reconfigure.parameter_generator_catkin import *\ngen = ParameterGenerator()\n"
BODY = """
gen.add("gain", double_t, 2, "A gain", 1.5, -10, 10)
inner = gen.add_group("Inner", state=False)
inner.add("count", int_t, 4, "Inside", 5)
gen.const("Few", int_t, 3, "Not many")
exit(gen.generate("tuned_pkg", "node", "Tuning"))
"""


@pytest.fixture
def cfg(tmp_path: Path) -> Path:
    file = tmp_path / "tuned_pkg" / "cfg" / "Tuning.cfg"
    file.parent.mkdir(parents=True)
    file.write_text(HEAD + BODY)
    return file


@contextmanager
def importable(package: Path) -> Iterator[None]:
    """`tuned_pkg` can be imported from a folder."""
    finder = PackageFinder(lambda name: str(package) if name == "tuned_pkg" else None)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "meta_path", [*sys.meta_path, finder])
        yield
    for name in [name for name in sys.modules if name.startswith("tuned_pkg")]:
        del sys.modules[name]


def test_a_file_declares_parameters_groups_and_constants(cfg: Path) -> None:
    contents = module_contents(read(cfg))

    assert contents["defaults"] == {"gain": 1.5, "count": 5}
    assert contents["max"] == {"gain": 10.0, "count": 2**31 - 1}
    assert (contents["level"], contents["all_level"]) == ({"gain": 2, "count": 4}, 6)
    assert contents["Tuning_Few"] == 3
    (inner,) = contents["config_description"]["groups"]
    assert (inner["class"], inner["field"], inner["state"]) == ("DEFAULT::INNER", "DEFAULT::inner", False)
    assert contents["config_description"]["parameters"][0]["srcfile"] == "Tuning.cfg"


def test_a_configuration_is_imported_without_a_build(cfg: Path) -> None:
    with importable(cfg.parent.parent):
        assert importlib.import_module("tuned_pkg.cfg.TuningConfig").defaults["gain"] == 1.5
        assert importlib.import_module("tuned_pkg.cfg").__all__ == ["TuningConfig"]
        with pytest.raises(ImportError):
            importlib.import_module("tuned_pkg.cfg.OtherConfig")
        cfg.write_text("raise ValueError('by the file')")
        del sys.modules["tuned_pkg.cfg.TuningConfig"]
        with pytest.raises(ImportError, match="by the file"):
            importlib.import_module("tuned_pkg.cfg.TuningConfig")


@pytest.mark.parametrize(
    ("file", "cmake"),
    [
        (
            "dynamic_reconfigure/Tuning.cfg",
            "generate_dynamic_reconfigure_options(dynamic_reconfigure/Tuning.cfg)",
        ),
        (
            "config/Tuning.cfg",
            "generate_dynamic_reconfigure_options(\n  ${PROJECT_SOURCE_DIR}/config/Tuning.cfg)",
        ),
        (
            "config/a/Tuning.cfg",
            "file(GLOB files config/*/*.cfg)\ngenerate_dynamic_reconfigure_options(${files})",
        ),
        ("Tuning.cfg", "generate_dynamic_reconfigure_options(lost/Tuning.cfg Tuning.cfg) # setup.cfg"),
    ],
)
def test_files_are_found_by_the_cmake_file(tmp_path: Path, file: str, cmake: str) -> None:
    package = tmp_path / "tuned_pkg"
    (package / file).parent.mkdir(parents=True)
    (package / file).write_text(HEAD + BODY)
    (package / "setup.cfg").touch()
    (package / "CMakeLists.txt").write_text(cmake)
    with importable(package):
        assert importlib.import_module("tuned_pkg.cfg.TuningConfig").defaults["gain"] == 1.5
        assert importlib.import_module("tuned_pkg.cfg").__all__ == ["TuningConfig"]


@pytest.mark.parametrize(
    "cmake", ["", "install(FILES other.cfg)", "# generate_dynamic_reconfigure_options(other.cfg)"]
)
def test_other_files_of_that_name_are_not_configurations(tmp_path: Path, cmake: str) -> None:
    (tmp_path / "other.cfg").touch()
    (tmp_path / "CMakeLists.txt").write_text(cmake)
    with importable(tmp_path), pytest.raises(ImportError):
        importlib.import_module("tuned_pkg.cfg")


def test_a_file_reads_the_variables_of_noetic_in_a_bare_shell(cfg: Path, monkeypatch) -> None:
    monkeypatch.delenv("ROS_DISTRO", raising=False)
    cfg.write_text(f"import os\nassert os.environ['ROS_DISTRO'] == 'noetic'\n{HEAD}{BODY}")

    assert read(cfg)["name"] == "Tuning"


@pytest.mark.parametrize(("text", "words"), [
    ("raise ValueError('by the file')", "by the file"), ("pass", r"did not call generate\(\)"),
    (HEAD + "gen.add('x', int_t, 0, 'd', 1.5)", "must be of type int, got 1.5"),
    (HEAD + "gen.add_group('a-b')", "a group name must begin with a letter"),
    (HEAD + "gen.add('1x', int_t, 0, 'd')", "a parameter name must begin with a letter"),
    (HEAD + "gen.add('x', str_t, 0, 'd', 'a', 'b')", "must not have min or max"),
    (HEAD + "gen.add('x', 'long', 0, 'd')", "must be one of str, bool, int, double"),
    (HEAD + "gen.const('X', int_t, 1, \"it's\")", "must not contain quotes"),
])  # fmt: skip
def test_a_bad_file_says_what_is_wrong(cfg: Path, text: str, words: str) -> None:
    cfg.write_text(text)

    with pytest.raises(BadConfigFile, match=words):
        read(cfg)


def test_a_file_that_never_ends_is_ended(cfg: Path) -> None:
    cfg.write_text("import threading\nthreading.Event().wait()")

    with pytest.raises(BadConfigFile, match=r"did not finish within 0\.3 s"):
        read(cfg, time_limit_s=0.3)


@pytest.mark.needs("process groups")
def test_processes_started_by_a_cfg_file_end_with_it(cfg: Path, tmp_path: Path) -> None:
    """A background process that inherited the file's standard error is not waited for."""
    child = "import os, threading; print(os.getpid(), flush=True); threading.Event().wait()"
    cfg.write_text(
        "import subprocess, sys\n"
        f"child = subprocess.Popen([sys.executable, '-c', {child!r}], stdout=subprocess.PIPE, text=True)\n"
        f"open({str(tmp_path / 'pid')!r}, 'w').write(child.stdout.readline())\n"
        "print('x' * 10**7, file=sys.stderr)\n"
        "raise SystemExit('the last words')\n"
    )

    with pytest.raises(BadConfigFile, match="the last words") as failed:
        read(cfg)

    assert len(str(failed.value)) < 3000
    pid = int((tmp_path / "pid").read_text())
    wait_until(lambda: not Path(f"/proc/{pid}/cmdline").exists() or not is_alive(pid), 30)


@pytest.mark.needs("/proc")
def test_a_daemon_that_it_started_ends_with_it(cfg: Path, tmp_path: Path) -> None:
    """A daemon, which has left the process group and its parent."""
    started = tmp_path / "pid"
    cfg.write_text(
        "import os, threading\n"
        "if os.fork() == 0:\n"
        "    os.setsid()\n"
        "    if os.fork() == 0:\n"
        "        os.closerange(0, 3)\n"
        f"        with open({str(started)!r} + '.new', 'w') as file: file.write(str(os.getpid()))\n"
        f"        os.rename({str(started)!r} + '.new', {str(started)!r})\n"
        "        threading.Event().wait()\n"
        "    os._exit(0)\n"
        "os.wait()\n"
        f"while not os.path.exists({str(started)!r}): pass\n" + cfg.read_text()
    )

    assert read(cfg)["name"] == "Tuning"
    wait_until(lambda: not is_alive(int(started.read_text())), 30)


GROUP = "g = {'name': '', 'type': '', 'state': True, 'id': 0, 'parent': 0, 'parameters': [], 'groups': []}\n"
WRITE = "import json, os\noutput = os.environ['PIPROS_CFG_OUTPUT']\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        pytest.param("os.mkfifo(output)", "it is not a regular file", marks=pytest.mark.needs("named pipes")),
        ("os.symlink('/dev/zero', output)", "it is not a regular file"),
        ("os.mkdir(output)", "it is not a regular file|Is a directory|Permission denied"),
        ("open(output, 'w').truncate(2**30)", "it is larger than"),
        ("open(output, 'wb').write(b'\\xff')", "utf-8"),
        ("open(output, 'w').write('{')", "are malformed: Expecting property name"),
        ("open(output, 'w').write('[' * 10**6)", "are malformed: "),
        ("open(output, 'w').write('[1]')", "malformed: must be an object with name, description"),
        (
            "json.dump({'name': 'x', 'description': 1, 'constants': []}, open(output, 'w'))",
            "malformed: a group",
        ),
        (
            GROUP + "g['parameters'] = [{'name': 'x'}]\n"
            "json.dump({'name': 'x', 'description': g, 'constants': []}, open(output, 'w'))",
            "malformed: a parameter",
        ),
        (
            GROUP + "g['groups'] = 5\n"
            "json.dump({'name': 'x', 'description': g, 'constants': []}, open(output, 'w'))",
            "malformed: a group",
        ),
        (
            GROUP + "json.dump({'name': 'x', 'description': g, 'constants': [{}]}, open(output, 'w'))",
            "malformed: a constant",
        ),
    ],
)
def test_a_result_that_generate_did_not_write_is_an_error(cfg: Path, text: str, words: str) -> None:
    cfg.write_text(WRITE + text)

    with pytest.raises(BadConfigFile, match=words):
        read(cfg)


@pytest.mark.needs("named pipes")
def test_a_file_that_is_a_pipe_is_an_error(cfg: Path) -> None:
    cfg.unlink()
    os.mkfifo(cfg)

    with pytest.raises(BadConfigFile, match="it is not a regular file"):
        read(cfg)
    assert find(cfg.parent.parent, "Other") is None


def is_alive(pid: int) -> bool:
    """Return whether the process runs; a zombie does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except (FileNotFoundError, ProcessLookupError):
        return False


def counting(cfg: Path, tmp_path: Path) -> Path:
    """Make the `.cfg` file count its runs; return the file whose length is the count."""
    runs = tmp_path / "runs"
    cfg.write_text(f"open({str(runs)!r}, 'a').write('.')\nimport sys\n" + cfg.read_text())
    return runs


def test_a_file_runs_once_until_it_changes(cfg: Path, tmp_path: Path) -> None:
    runs = counting(cfg, tmp_path)
    first = read(cfg)

    assert read(cfg) == first
    assert len(runs.read_text()) == 1
    cfg.write_text(cfg.read_text().replace('"gain", double_t, 2', '"gain", double_t, 8'))
    assert module_contents(read(cfg))["level"]["gain"] == 8
    assert len(runs.read_text()) == 2
    other = cfg.with_name("Other.cfg")
    other.write_text(cfg.read_text())
    assert read(other)["description"]["parameters"][0]["srcfile"] == "Other.cfg"


def test_the_fraction_of_a_level_is_dropped_as_in_cpp(cfg: Path) -> None:
    """opencv_apps has `gen.add("scale0", double_t, 1.05, …)`."""
    cfg.write_text(cfg.read_text().replace('"gain", double_t, 2', '"gain", double_t, 1.05'))
    assert module_contents(read(cfg))["level"]["gain"] == 1


def test_a_file_runs_again_when_what_it_imports_changes(cfg: Path, tmp_path: Path) -> None:
    module = tmp_path / "common_gains.py"
    module.write_text("LEVEL = 1\n")
    text = f"import sys\nsys.path.insert(0, {str(tmp_path)!r})\nfrom common_gains import LEVEL\n"
    cfg.write_text(text + HEAD + BODY.replace("double_t, 2", "double_t, LEVEL"))
    assert module_contents(read(cfg))["level"]["gain"] == 1

    module.write_text("LEVEL = 64\n")
    assert module_contents(read(cfg))["level"]["gain"] == 64
    module.unlink()
    with pytest.raises(BadConfigFile, match="common_gains"):
        read(cfg)


def test_an_unreadable_entry_is_replaced(cfg: Path, tmp_path: Path) -> None:
    runs = counting(cfg, tmp_path)
    first = read(cfg)
    entry = Path(cache_folder("cfg")) / cache._entry(cfg)
    for broken in (
        b"",
        b"{",
        b"[]",
        b"{}",
        b'{"sources": []}',
        b'{"sources": [["x"]]}',
        b"\xff" * 9,
        b"[" * 10**5,
    ):
        entry.write_bytes(broken)
        assert read(cfg) == first
    assert len(runs.read_text()) == 9
    with pytest.raises(BadConfigFile, match="cannot read"):
        read(tmp_path / "nothing.cfg")


def test_configurations_and_descriptions_survive_conversion_to_messages(cfg: Path) -> None:
    class Module:
        pass

    for name, value in module_contents(read(cfg)).items():
        setattr(Module, name, value)

    described = decode_description(encode_description(Module))
    assert described["parameters"][0] == {
        "name": "gain", "min": -10.0, "max": 10.0, "default": 1.5, "type": "double", "level": 2,
        "description": "A gain", "edit_method": "",
    }  # fmt: skip
    assert [each["name"] for each in described["groups"]["Inner"]["parameters"]] == ["count"]
    config = Config(gain=1.0, count=3, on=True, name="x")
    assert decode_config(encode_config(config)) == config
    assert config.gain == 1.0
    with pytest.raises(AttributeError):
        _ = config.nothing


def test_a_cfg_file_that_is_run_directly_explains_that_it_need_not_be(monkeypatch, capsys) -> None:
    monkeypatch.delenv("PIPROS_CFG_OUTPUT", raising=False)

    assert ParameterGenerator().generate("a", "b", "C") == 1
    assert "no need to run a .cfg file" in capsys.readouterr().err

"""Indexes of wheels, the plan of an installation, and the tables of keys."""

import os
import struct
import subprocess
import sys
import tracemalloc
import zipfile
from collections.abc import Sequence
from pathlib import Path

import pytest

from pipros.basics.errors import InvalidName, PiprosError
from pipros_wheels import installer, plan
from pipros_wheels.commands import index as index_command
from pipros_wheels.commands import install as install_command
from pipros_wheels.commands import rosdep
from pipros_wheels.commands import wheel as wheel_command
from pipros_wheels.index import read_wheel_name, write_index
from pipros_wheels.names import distribution_name, is_requirement
from pipros_wheels.plan import Places, PlanStep, Provider, make_plan
from pipros_wheels.python_keys import PYTHON_KEYS, read_keys
from pipros_wheels.wheel_build import source_packages
from tests.support.workspaces import Workspace


def add_wheel(
    folder: Path, name: str, version: str, python: str = ">=3.10", requires: Sequence[str] = ()
) -> Path:
    folder.mkdir(exist_ok=True)
    file = folder / f"{name}-{version}-py3-none-any.whl"
    with zipfile.ZipFile(file, "w") as archive:
        lines = [f"Name: {name}\nRequires-Python: {python}", *(f"Requires-Dist: {item}" for item in requires)]
        archive.writestr(f"{name}-{version}.dist-info/METADATA", "\n".join(lines) + "\n")
    return file


def test_an_index_lists_wheels_with_hashes(tmp_path: Path) -> None:
    for version in ("1.9.0", "1.10.0", "1.10.0rc1"):
        add_wheel(tmp_path, "ros1_arm", version)
    add_wheel(tmp_path, "Other", "2.0")
    assert index_command.main([str(tmp_path)]) == 0
    pages = {file.relative_to(tmp_path).as_posix(): file.read_text() for file in tmp_path.rglob("*.html")}
    assert set(pages) == {"simple/index.html", "simple/other/index.html", "simple/ros1-arm/index.html"}
    assert '<a href="ros1-arm/">ros1-arm</a>' in pages["simple/index.html"]
    assert 'data-requires-python="&gt;=3.10"' in pages["simple/ros1-arm/index.html"]
    assert pages["simple/ros1-arm/index.html"].count("#sha256=") == 3
    lock = (tmp_path / "requirements.lock").read_text()
    assert "ros1-arm==1.10.0 \\\n    --hash=sha256:" in lock
    assert lock.count("ros1-arm") == 1
    (tmp_path / "Other-2.0-py3-none-any.whl").unlink()
    write_index(tmp_path, [])
    assert not (tmp_path / "simple" / "other").exists()


@pytest.mark.parametrize(
    "name", ["a.whl", "a-1.whl", "../a-1-py3-none-any.whl", "a b-1-py3-none-any.whl", ""]
)
def test_names_that_are_not_those_of_wheels(name: str) -> None:
    with pytest.raises(PiprosError, match="is not the file name of a wheel"):
        read_wheel_name(name)


def test_files_that_are_not_wheels_are_refused(tmp_path: Path) -> None:
    with pytest.raises(PiprosError, match="has no wheels"):
        write_index(tmp_path, [])
    (tmp_path / "a-1-py3-none-any.whl").write_text("no zip file")
    with pytest.raises(PiprosError, match=r"a-1-py3-none-any\.whl is not a wheel"):
        write_index(tmp_path, [])
    assert index_command.main([str(tmp_path)]) == 1
    assert not (tmp_path / "simple").exists()


@pytest.mark.needs("named pipes")
def test_a_pipe_beside_the_wheels_is_left_out(tmp_path: Path) -> None:
    add_wheel(tmp_path, "good", "1.0")
    os.mkfifo(tmp_path / "pipe-1.0-py3-none-any.whl")
    errors: list[str] = []
    write_index(tmp_path, errors)
    assert "pipe-1.0-py3-none-any.whl is not a wheel: it is not a regular file" in errors[0]
    assert (tmp_path / "simple" / "good" / "index.html").exists()


def test_metadata_is_not_decompressed_beyond_the_size_that_it_claims(tmp_path: Path) -> None:
    file = tmp_path / "a-1-py3-none-any.whl"
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a-1.dist-info/METADATA", bytes(64 * 1024 * 1024))
    content = bytearray(file.read_bytes())
    struct.pack_into("<I", content, content.rfind(b"PK\1\2") + 24, 1000)  # the uncompressed size
    file.write_bytes(content)
    tracemalloc.start()
    try:
        with pytest.raises(PiprosError, match="is not a wheel"):
            write_index(tmp_path, [])
        assert tracemalloc.get_traced_memory()[1] < 16 * 1024 * 1024
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("compression", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_metadata_whose_decompression_cannot_be_bounded_is_refused(tmp_path: Path, compression: int) -> None:
    with zipfile.ZipFile(tmp_path / "a-1-py3-none-any.whl", "w", compression) as archive:
        archive.writestr("a-1.dist-info/METADATA", "Name: a")
    with pytest.raises(PiprosError, match="must be stored or deflated"):
        write_index(tmp_path, [])


def test_keys_are_requirements(tmp_path: Path) -> None:
    assert all(is_requirement(value) for value in PYTHON_KEYS.values() if value)
    assert PYTHON_KEYS["python3-serial"] == PYTHON_KEYS["python-serial"] == PYTHON_KEYS["python3-serial-pip"]
    named = ("click", "colorama", "progressbar", "texttable", "github")  # the keys of jsk_common
    assert [PYTHON_KEYS[f"python3-{name}"] for name in named] == [
        *("click", "colorama", "progressbar2", "texttable", "PyGithub")
    ]
    file = tmp_path / "keys.yaml"
    file.write_text("my_key: pyserial>=3.5\npython3-yaml: ruamel.yaml\n")
    assert read_keys(str(file))["my_key"] == "pyserial>=3.5"
    assert read_keys(str(file))["python3-yaml"] == "ruamel.yaml"
    for text in ("- a", "a: [1]", "a: --index-url=x", "a: 'b @ https://example.org/c'", "a: 'b c'"):
        file.write_text(text)
        with pytest.raises(PiprosError, match=r"keys\.yaml"):
            read_keys(str(file))


@pytest.mark.parametrize("name", ["arm_", "_arm", "a__b", "2arm", "ärm", "a b", "", "a/b", "-a"])
def test_names_that_are_not_those_of_distributions(name: str) -> None:
    with pytest.raises(InvalidName, match="must consist of letters and digits"):
        distribution_name(name)


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Workspace:
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    monkeypatch.setattr(plan, "debian_package", lambda name: "libarm-dev" if name == "libarm" else "")
    made = Workspace(tmp_path / "ws")
    made.add("arm", depends="hand far_msgs rospy python3-semver python3-yaml libarm strange")
    made.add("hand", "message(FATAL_ERROR no)", setup_dot_py="raise SystemExit('was run')")
    return made


def test_a_plan_names_what_provides_each_dependency(workspace: Workspace, tmp_path: Path) -> None:
    packages = source_packages([workspace.base]).packages
    steps = {step.name: step for step in make_plan(packages, Places((), None, PYTHON_KEYS), [])}
    assert {name: step.provider for name, step in steps.items()} == {
        "arm": Provider.SOURCE, "far_msgs": Provider.UNKNOWN, "hand": Provider.SOURCE,
        "libarm": Provider.DEBIAN, "python3-semver": Provider.PYPI, "python3-yaml": Provider.PIPROS,
        "rospy": Provider.PIPROS, "strange": Provider.UNKNOWN,
    }  # fmt: skip
    assert (steps["libarm"].target, steps["hand"].needed_by) == ("libarm-dev", ("arm",))
    add_wheel(tmp_path / "wheels", "ros1_far_msgs", "1.0")
    places = Places((tmp_path / "wheels",), lambda name: name == "ros1-strange", PYTHON_KEYS)
    steps = {step.name: step for step in make_plan(packages, places, [])}
    assert (steps["far_msgs"].provider, steps["strange"].provider) == (Provider.FOLDER, Provider.INDEX)


def step_of(workspace: Workspace, places: Places, name: str, errors: list[str] | None = None) -> PlanStep:
    packages = source_packages([workspace.base]).packages
    steps = make_plan(packages, places, [] if errors is None else errors)
    (found,) = [step for step in steps if step.name == name]
    return found


@pytest.mark.parametrize(("limit", "version"), [
    *(
        ("~=1.2", "1.9"), ("~=1.2.0", "1.2.3"), ("==1.2.*", "1.2.3"), ("!=1.*", "2.0"),
        ("===1.2.0", "1.2.0"),
    ),
    *(("<1.9,!=1.2.3", "1.2.0"), (">=1.2,<2", "1.9"), ("", "2.0"), ("==3", None), ("=>1", None)),
])  # fmt: skip
def test_a_wheel_in_a_folder_is_within_the_limits_of_the_wheel_that_requires_it(
    workspace: Workspace, tmp_path: Path, limit: str, version: str | None
) -> None:
    for each in ("1.2.0", "1.2.3", "1.9", "2.0"):
        add_wheel(tmp_path / "wheels", "ros1_base_msgs", each)
    add_wheel(tmp_path / "wheels", "ros1_far_msgs", "1.0", requires=(f"ros1-base-msgs{limit}",))
    step = step_of(workspace, Places((tmp_path / "wheels",), None, {}), "ros1-base-msgs")
    assert step.target == (f"ros1-base-msgs=={version}" if version else "")
    assert step.needed_by == ("ros1-far-msgs",)


def test_the_limits_of_all_users_of_a_distribution_count(workspace: Workspace, tmp_path: Path) -> None:
    wheels = tmp_path / "wheels"
    for version in ("1.0", "1.5", "2.0"):
        add_wheel(wheels, "ros1_strange", version)
        add_wheel(wheels, "semver", version)
    add_wheel(wheels, "ros1_far_msgs", "1.0", requires=("ros1-strange<2", "semver<=1.5", "labtool<3", "six"))
    add_wheel(wheels, "ros1_new_msgs", "1.0", requires=("ros1-strange!=1.5", "labtool>=2", "six[all]; a"))
    workspace.add("leg", depends="new_msgs")
    for name, target, users in (
        ("strange", "ros1-strange==1.0", ("arm", "ros1-far-msgs", "ros1-new-msgs")),
        ("python3-semver", "semver==1.5", ("arm", "ros1-far-msgs")),
        ("labtool", "labtool<3,>=2", ("ros1-far-msgs", "ros1-new-msgs")),
    ):
        step = step_of(workspace, Places((wheels,), None, {"python3-semver": "semver"}), name)
        assert (step.target, step.needed_by) == (target, users)
    plan = make_plan(source_packages([workspace.base]).packages, Places((wheels,), None, {}), [])
    assert [step.target for step in plan if step.name == "six"] == ["six", "six[all]; a"]


def test_the_index_is_asked_once_for_each_requirement_with_its_limits(workspace: Workspace, tmp_path) -> None:
    add_wheel(tmp_path / "wheels", "ros1_far_msgs", "1.0", requires=("ros1-strange>=1.2", "ros1-lost"))
    add_wheel(tmp_path / "wheels", "ros1_hip_msgs", "1.0", requires=("ros1-strange<2", "ros1-lost"))
    workspace.add("leg", depends="strange hip_msgs")
    asked: list[str] = []

    def has_in_index(requirement: str) -> bool:
        asked.append(requirement)
        return requirement.startswith("ros1-strange")

    step = step_of(workspace, Places((tmp_path / "wheels",), has_in_index, {}), "strange")
    assert (step.provider, step.target) == (Provider.INDEX, "ros1-strange>=1.2,<2")
    assert sorted(asked) == [
        "ros1-libarm", "ros1-lost", "ros1-python3-semver", "ros1-python3-yaml", "ros1-strange>=1.2,<2",
    ]  # fmt: skip


def test_an_installed_wheel_outside_of_the_limits_is_replaced_or_reported(
    workspace: Workspace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    add_wheel(tmp_path / "wheels", "ros1_far_msgs", "1.0", requires=("ros1-strange>=1.2",))
    monkeypatch.setattr(plan, "installed_version", lambda name: "1.0" if name == "ros1-strange" else None)
    for has_in_index, provider in ((lambda _name: True, Provider.INDEX), (None, Provider.INSTALLED)):
        errors: list[str] = []
        places = Places((tmp_path / "wheels",), has_in_index, {})
        assert step_of(workspace, places, "strange", errors).provider is provider
    assert errors == [
        "arm, ros1-far-msgs requires ros1-strange>=1.2, but 1.0 is installed, and no folder or chosen index "
        "has another that fits"
    ]


def test_a_dry_run_prints_the_plan_and_runs_no_code(workspace: Workspace, capsys, tmp_path: Path) -> None:
    assert install_command.main(["--dry-run", str(workspace.base)]) == 0
    shown = capsys.readouterr().out
    assert "python3-semver  PyPI" in shown
    assert "Not installed, because it needs root: apt-get install libarm-dev" in shown
    assert "Unknown, and not installed: far_msgs strange" in shown
    keys = tmp_path / "keys.yaml"
    keys.write_text("strange: oddity")
    assert install_command.main(["--dry-run", "--keys", str(keys), str(workspace.base)]) == 0
    assert "oddity" in capsys.readouterr().out
    assert install_command.main([str(workspace.base)]) == 1
    assert "no" in capsys.readouterr().err


def test_apt_is_asked_for_names_only(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def run(words: list[str], **_options: object) -> subprocess.CompletedProcess[bytes]:
        asked.append(words[1:])
        return subprocess.CompletedProcess(words, int(words[-1] != "ros-arm"), b"Package: x")

    monkeypatch.setattr(plan.shutil, "which", lambda _name: "/usr/bin/apt-cache")
    monkeypatch.setattr(plan.subprocess, "run", run)
    assert plan.debian_package("arm") == "ros-arm"
    assert (asked[0], plan.debian_package("--option")) == (["show", "--no-all-versions", "--", "arm"], "")
    assert plan.debian_package("image_proc") == "ros-image-proc"


def test_the_installer_is_pip_or_uv(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert installer.find_installer() == (sys.executable, "-m", "pip")
    monkeypatch.setattr(installer.importlib.util, "find_spec", lambda _name: None)
    monkeypatch.setattr(installer.shutil, "which", lambda name: f"/bin/{name}" if name == "uv" else None)
    assert installer.find_installer() == ("/bin/uv", "pip")
    made = installer.Installer(("/bin/uv", "pip"), (tmp_path,), "https://example.org/simple")
    assert made.options() == [
        *(
            "--python", sys.executable, "--index-url", "https://example.org/simple", "--find-links",
            str(tmp_path),
        )
    ]  # fmt: skip
    assert made.environment({"PIP_FIND_LINKS": "/a"})["PIP_FIND_LINKS"] == f"/a {tmp_path}"
    assert made.environment({"UV_FIND_LINKS": "/a"})["UV_FIND_LINKS"] == f"/a,{tmp_path}"
    spaced = installer.Installer(("pip",), (tmp_path / "a b",)).environment({})
    assert spaced["PIP_FIND_LINKS"] == f"{tmp_path.as_uri()}/a%20b"
    monkeypatch.setattr(installer.shutil, "which", lambda _name: None)
    with pytest.raises(PiprosError, match="neither pip nor uv is installed"):
        installer.find_installer()


def test_built_wheels_replace_installed_ones_of_the_same_version(monkeypatch, tmp_path: Path) -> None:
    run: list[list[str]] = []

    def record(words: list[str], **_options: object) -> subprocess.CompletedProcess[str]:
        run.append(words[2:])
        return subprocess.CompletedProcess(words, 0)

    monkeypatch.setattr(installer.subprocess, "run", record)
    info = tmp_path / "ros1_arm-1.0.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: ros1-arm\nVersion: 1.0.0\n")
    monkeypatch.syspath_prepend(tmp_path)
    same, newer = (tmp_path / f"ros1_arm-{version}-py3-none-any.whl" for version in ("1.0.0", "1.1.0"))
    made = installer.Installer(("uv", "pip"))
    made.install(["six"], {newer: ""})
    assert [words[-2:] for words in run] == [["--no-deps", str(newer)], [sys.executable, "six"]]
    made.install([], {same: ""})
    assert run[3][-3:] == ["--force-reinstall", "--no-deps", str(same)]


def test_rosdep_answers_from_the_same_table(workspace: Workspace, capsys, monkeypatch) -> None:
    monkeypatch.setenv("PATH", "/nowhere")
    paths = ["--from-paths", str(workspace.base), "--ignore-src", "-y"]
    assert rosdep.main(["update"]) == 0
    assert capsys.readouterr().out.startswith("nothing to do")
    assert rosdep.main(["keys", *paths]) == 0
    assert "python3-semver" in capsys.readouterr().out.splitlines()
    assert rosdep.main(["check", *paths]) == 1
    assert "strange" in capsys.readouterr().out
    assert rosdep.main(["install", "--simulate", *paths]) == 0
    shown = capsys.readouterr().out
    assert "libarm: Debian (not installed) libarm-dev" in shown
    assert shown.endswith("pip install semver\n")


def test_a_genuine_rosdep_is_run_instead(tmp_path: Path) -> None:
    genuine = tmp_path / "rosdep"
    genuine.write_text('#!/bin/sh\necho "genuine $*"\n')
    genuine.chmod(0o755)
    code = "from pipros_wheels.commands.rosdep import main; main(['check', '--os=x'])"
    ended = subprocess.run(
        [sys.executable, "-c", code], env={"PATH": str(tmp_path)}, capture_output=True, text=True
    )
    assert ended.stdout == "genuine check --os=x\n"


def test_commands_print_errors_on_one_line(workspace: Workspace, capsys, tmp_path: Path) -> None:
    assert wheel_command.main([str(workspace.base), "-o", str(tmp_path / "out")]) == 1
    assert capsys.readouterr().err.startswith("pipros wheel: ")
    assert list(tmp_path.glob("out/*")) == []
    assert wheel_command.main([str(tmp_path / "gone")]) == 1
    assert "must be a folder, the URL" in capsys.readouterr().err

"""ROS packages that pip installed: found without any variable, and one winner per package."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from pipros.basics.errors import NotFound
from pipros.msg.importing.hook import installed_library
from pipros.packages import SHARE, ImportablePackages, installed_packages
from pipros.packages.system_packages import child_package_path
from pipros_workspace.candidates import describe_candidates
from pipros_workspace.executables import find_executables, list_executables
from pipros_workspace.index import SHARED_PACKAGES, PackageIndex

MANIFEST = "<package><name>{}</name><version>{}</version></package>"
COUNT = """
import os, sys
calls, real = [], os.stat
def counted(*arguments, **options):
    calls.append("stat")
    return real(*arguments, **options)
os.stat = counted
counted_events = ("open", "os.listdir", "os.scandir")
sys.addaudithook(lambda event, _: calls.append(event) if event in counted_events else None)
import rospy
from pipros_workspace.index import PackageIndex
PackageIndex.from_environment().find("p0")
print(len(calls), "importlib.metadata" in sys.modules)
"""


class Installation:
    """Packages as `pip install --target` lays them out, in a folder on `sys.path`."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.share = folder / "share"
        self.share.mkdir(parents=True)

    def add(self, name: str, version: str = "1.0.0", **files: str) -> Path:
        files[f"share/{name}/package.xml"] = MANIFEST.format(name, version)
        write(self.folder, files)
        return self.share / name

    def add_module(self, name: str, text: str, package: str) -> None:
        write(self.folder, {f"{name}/__init__.py": text, f"share/pipros/modules/{name}": f"{package}\n"})

    def add_editable(self, name: str, source: Path) -> None:
        write(self.folder, {f"share/pipros/editable/{name}": f"{source}\n"})

    def shows(self, code: str, **variables: str) -> str:
        environment = {key: value for key, value in os.environ.items() if not key.startswith("ROS_")}
        environment |= {"PYTHONPATH": str(self.folder), "ROS_HOME": str(self.folder / "home"), **variables}
        ended = subprocess.run(
            [sys.executable, "-c", code], env=environment, cwd=self.folder, capture_output=True, text=True
        )
        return (ended.stdout if ended.returncode == 0 else ended.stderr.splitlines()[-1]).strip()


def write(folder: Path, files: dict[str, str]) -> None:
    for path, text in files.items():
        file = folder / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)


@pytest.fixture
def installation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Installation:
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    made = Installation(tmp_path / "target")
    monkeypatch.syspath_prepend(str(made.folder))
    return made


@pytest.mark.parametrize(
    ("site", "share"),
    [
        ("lib/python3.11/site-packages", "share"),
        ("local/lib/python3.11/dist-packages", "local/share"),
        ("Lib/site-packages", "share"),
        ("target", "target/share"),
        ("lib/python3/dist-packages", None),  # of Debian, or of a workspace
        ("other/site-packages", None),
    ],
)
def test_the_share_folder_of_an_entry_of_the_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, site: str, share: str | None
) -> None:
    for folder in (site, share or "share"):
        (tmp_path / folder).mkdir(parents=True, exist_ok=True)
    before = installed_packages.share_folders()
    monkeypatch.syspath_prepend(str(tmp_path / site))
    found = [folder for folder in installed_packages.share_folders() if folder not in before]
    assert found == ([str(tmp_path / share)] if share else [])


def test_an_installed_package_needs_no_variable(installation: Installation) -> None:
    folder = installation.add("arm")
    assert ImportablePackages().find("arm") == str(folder)
    assert PackageIndex.from_environment().find("arm").path == folder
    assert "arm" in [package.name for package in PackageIndex.from_environment()]


def test_other_names_are_not_found(installation: Installation) -> None:
    write(
        installation.folder, {"share/other/package.xml": MANIFEST.format("arm", "1.0.0"), "share/man/x": ""}
    )
    index = PackageIndex.from_environment()
    for name in ("other", "man", "..", "pipros/editable/x", "", "nul\0", "x" * 300):
        assert index.get(name) is None


def test_packages_of_ros2_are_not_found(installation: Installation) -> None:
    by_manifest = installation.add("by_manifest")
    manifest = by_manifest / "package.xml"
    manifest.write_text(
        manifest.read_text().replace("</name>", "</name><build_type>ament_cmake</build_type>")
    )
    by_index = installation.add("by_index")
    write(installation.share, {"ament_index/resource_index/packages/by_index": ""})
    installation.add("of_ros1")
    assert installed_packages.find("by_manifest") is None
    assert installed_packages.find("by_index") is None
    assert installed_packages.find("of_ros1") is not None
    assert installed_packages.find_of_ros2("by_index") == str(by_index)
    assert installed_packages.find_of_ros2("by_manifest") == str(by_manifest)
    assert installed_packages.find_of_ros2("of_ros1") is None
    with pytest.raises(NotFound, match="by_index is a package of ROS 2"):
        installed_library().files.folder("by_index")


def test_installed_packages_are_between_the_path_and_those_of_pipros(
    installation: Installation, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    installed = installation.add("std_msgs", "9.0.0")
    overlay = tmp_path / "ws" / "std_msgs"
    write(overlay, {"package.xml": MANIFEST.format("std_msgs", "10.0.0")})
    assert PackageIndex.from_environment().find("std_msgs").path == installed
    # as the setup file of an empty workspace leaves it
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{tmp_path / 'empty'}:{SHARED_PACKAGES}")
    assert PackageIndex.from_environment().find("std_msgs").path == installed
    assert ImportablePackages().find("std_msgs") == str(installed)
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{tmp_path / 'ws'}:{SHARED_PACKAGES}")
    index = PackageIndex.from_environment()
    assert index.find("std_msgs").path == overlay
    lines = describe_candidates(index, "std_msgs")
    assert lines[0] == f"{overlay}  10.0.0  ROS_PACKAGE_PATH"
    assert lines[1] == f"{installed}  9.0.0  pip, hidden"
    assert lines[2].startswith(f"{SHARED_PACKAGES / 'std_msgs'}  ")
    assert lines[2].endswith("  pipros, hidden")


def test_an_editable_package_is_its_source_folder(installation: Installation, tmp_path: Path) -> None:
    source = tmp_path / "source" / "arm"
    setup = "from distutils.core import setup\nsetup(packages=['arm_lib'], package_dir={'': 'src'})\n"
    write(source, {
        "package.xml": MANIFEST.format("arm", "1.0.0"), "setup.py": setup, "src/arm_lib/__init__.py": "A = 1",
    })  # fmt: skip
    installation.add_editable("arm", source)
    index = PackageIndex.from_environment()
    assert index.find("arm").path == source
    assert describe_candidates(index, "arm") == [f"{source}  1.0.0  pip, editable"]
    assert ImportablePackages().find_module("arm_lib", None) == str(source / "src" / "arm_lib")
    write(installation.folder, {"share/pipros/editable/gone": "/nowhere/gone\n"})
    assert index.get("gone") is None


@pytest.mark.needs("executable files")
def test_programs_are_in_the_lib_folder_beside_share(installation: Installation) -> None:
    installation.add("arm")
    program = installation.folder / "lib" / "arm" / "move"
    write(program.parent, {"move": "#!/bin/sh\n"})
    program.chmod(0o755)
    package = PackageIndex.from_environment().find("arm")
    assert find_executables(package, "move", ()).runnable == (program,)
    assert list_executables(package, ()) == ["move"]


def test_compiled_programs_find_installed_packages(installation: Installation) -> None:
    folder = installation.add("arm")
    path = child_package_path(f"/ws:{SHARE}", [SHARE], list(installed_packages.folders()))
    assert path.split(":")[:2] == ["/ws", str(folder)]
    assert path.split(":")[-1] == SHARE


OLD = {"share/arm/launch/run.launch": "old", "share/arm/msg/State.msg": "int8 old"}
NEW = {"launch/run.launch": "new", "msg/State.msg": "int8 new"}
SHOW = (
    "import {module}; from arm.msg import State; from pipros_workspace.index import PackageIndex\n"
    "folder = PackageIndex.from_environment().find('arm').path\n"
    "print({module}.WHO, State.__slots__, (folder / 'launch' / 'run.launch').read_text())"
)


@pytest.mark.parametrize("module", ["arm", "arm_lib"])
def test_a_package_has_one_winner_for_modules_messages_and_files(installation, tmp_path, module: str) -> None:
    installation.add("arm", **OLD)
    installation.add_module("arm", "WHO = 'old'", "arm")
    installation.add_module("arm_lib", "WHO = 'old'", "arm")
    setup = f"from distutils.core import setup\nsetup(packages=['{module}'], package_dir={{'': 'src'}})\n"
    files = {**NEW, "package.xml": MANIFEST.format("arm", "2.0.0"), "setup.py": setup}
    write(tmp_path / "ws" / "cloned", {**files, f"src/{module}/__init__.py": "WHO = 'new'"})
    code = SHOW.format(module=module)
    assert installation.shows(code) == "old ['old'] old"
    assert installation.shows(code, ROS_PACKAGE_PATH=str(tmp_path / "ws")) == "new ['new'] new"


def test_modules_that_only_the_hidden_wheel_has_are_hidden_with_it(installation, tmp_path) -> None:
    installation.add("arm", **OLD)
    installation.add_module("arm", "WHO = 'old'", "arm")
    installation.add_module("arm_lib", "WHO = 'old'", "arm")
    write(tmp_path / "ws" / "arm", {**NEW, "package.xml": MANIFEST.format("arm", "2.0.0")})
    path = {"ROS_PACKAGE_PATH": str(tmp_path / "ws")}
    assert installation.shows("import arm; print(hasattr(arm, 'WHO'))", **path) == "False"
    assert installation.shows("from arm.msg import State; print(State.__slots__)", **path) == "['new']"
    assert "hides the installed package arm, and has no such module" in installation.shows(
        "import arm_lib", **path
    )


def test_rospkg_finds_installed_packages(installation: Installation) -> None:
    folder = installation.add("arm")
    assert installation.shows("import rospkg; print(rospkg.RosPack().get_path('arm'))") == str(folder)


def test_the_cost_of_finding_a_package_does_not_grow_with_the_number_installed(installation) -> None:
    def calls() -> int:
        """Return the fewest calls of several runs, as some also compile modules."""
        shown = [installation.shows(COUNT).split() for _ in range(2)]
        assert {loads_metadata for _, loads_metadata in shown} == {"False"}
        return min(int(count) for count, _ in shown)

    installation.add("p0")
    few = calls()
    for number in range(1, 300):
        installation.add(f"p{number}")
    assert calls() <= few

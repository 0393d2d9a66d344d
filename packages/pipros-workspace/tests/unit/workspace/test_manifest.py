from __future__ import annotations

from pathlib import Path

import pytest

from pipros.safe.xml import XmlError
from pipros_workspace.crawl_times import crawl_times
from pipros_workspace.manifest import read_manifest


def write(folder: Path, content: str, name: str = "package.xml") -> Path:
    folder.mkdir(exist_ok=True)
    (folder / name).write_text(content)
    return folder


def test_name_version_and_description_are_trimmed(tmp_path: Path) -> None:
    manifest = read_manifest(
        write(
            tmp_path,
            "<package><name> p </name><version>\n1.2.3</version><description>a\n  b</description></package>",
        )
    )
    assert (manifest.name, manifest.version, manifest.description) == ("p", "1.2.3", "a b")
    assert not manifest.is_dry


def test_missing_elements_are_empty_and_the_name_is_that_of_the_folder(tmp_path: Path) -> None:
    manifest = read_manifest(write(tmp_path / "robot", "<package/>"))
    assert (manifest.name, manifest.version, manifest.dependencies, manifest.exports) == ("robot", "", (), ())


@pytest.mark.parametrize(("element", "kinds"), [
    ("run_depend", {"build_export_depends", "exec_depends"}),
    ("depend", {"build_depends", "build_export_depends", "exec_depends"}),
    ("exec_depend", {"exec_depends"}), ("test_depend", {"test_depends"}), ("doc_depend", {"doc_depends"}),
    ("buildtool_depend", {"buildtool_depends"}), ("conflict", set()),
])  # fmt: skip
def test_elements_are_parsed_to_these_lists(tmp_path: Path, element: str, kinds: set[str]) -> None:
    manifest = read_manifest(write(tmp_path, f"<package><{element}> x </{element}><{element}/></package>"))
    assert {kind for kind, _ in manifest.dependencies} == kinds
    assert manifest.depends() == (["x"] if kinds else [])
    assert manifest.depends("exec_depends") == (["x"] if "exec_depends" in kinds else [])


@pytest.mark.parametrize(("condition", "holds"), [
    ("$ROS_PYTHON_VERSION == 3", True), ("$ROS_PYTHON_VERSION==2", False), ("$ROS_VERSION != 2", True),
    ("$ROS_DISTRO == 'noetic' and $ROS_VERSION == \"1\"", True),
    ("$ROS_DISTRO == noetic and $ROS_PYTHON_VERSION == 2", False), ("", True),
])  # fmt: skip
def test_conditions_have_the_values_of_noetic(tmp_path: Path, condition: str, holds: bool) -> None:
    quoted = condition.replace('"', "&quot;")
    manifest = read_manifest(write(tmp_path, f'<package><depend condition="{quoted}">x</depend></package>'))
    assert bool(manifest.depends()) is holds


def test_a_dry_manifest_has_other_tags(tmp_path: Path) -> None:
    content = (
        '<package><depend package="a"/><depend/><rosdep name="boost"/><rosdep/>'
        '<export><cpp cflags="-I"/></export></package>'
    )
    manifest = read_manifest(write(tmp_path / "old", content, "manifest.xml"))
    assert (manifest.name, manifest.is_dry, manifest.rosdeps) == ("old", True, ("boost",))
    assert (manifest.depends("exec_depends"), manifest.exports[0].attributes) == (["a"], {"cflags": "-I"})


@pytest.mark.parametrize("content", ["<package", "<other/>", "", "<!DOCTYPE a []><package/>"])
def test_malformed_manifests_are_reported_with_their_line(tmp_path: Path, content: str) -> None:
    with pytest.raises(XmlError, match=r"package\.xml:1:"):
        read_manifest(write(tmp_path, content))


def test_a_missing_manifest_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        read_manifest(tmp_path)


def test_the_profile_marks_folders_without_packages(tmp_path: Path) -> None:
    write(tmp_path / "a", "<name>a</name>")
    for folder in ("b/c", ".hidden"):
        (tmp_path / folder).mkdir(parents=True)
    lines = crawl_times([tmp_path, tmp_path / "nowhere"], -1)
    assert lines[0].startswith("Full tree crawl took ")
    marks = {line[11:]: line[9] for line in lines[6:]}
    assert marks == {
        f"{tmp_path}/": " ", f"{tmp_path}/a": " ", f"{tmp_path}/b": "*", f"{tmp_path}/nowhere/": "*",
    }  # fmt: skip
    assert len(crawl_times([tmp_path], 1)) == 7
    assert crawl_times([tmp_path], 20, only_empty=True) == [f"{tmp_path}/b"]

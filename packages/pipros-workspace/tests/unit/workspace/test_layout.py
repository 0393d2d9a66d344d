from __future__ import annotations

from pathlib import Path

import pytest

from pipros_workspace.layout import closure, read_source_space

MANIFEST = """<package format="3"><name>{name}</name><version>1.0.0</version><description>d</description>
<maintainer email="a@example.org">A</maintainer><license>x</license>{rest}</package>"""


def add(source: Path, name: str, rest: str = "", folder: str = "") -> Path:
    path = source / (folder or name)
    path.mkdir(parents=True)
    (path / "package.xml").write_text(MANIFEST.format(name=name, rest=rest))
    return path


def names(source: Path, **variables: str) -> list[str]:
    return [package.name for package in read_source_space(source, variables).packages]


def test_packages_follow_their_dependencies(tmp_path: Path) -> None:
    add(tmp_path, "a", "<depend>b</depend>")
    add(tmp_path, "b", "<build_depend>c</build_depend><exec_depend>elsewhere</exec_depend>")
    add(tmp_path, "c", "<test_depend>d</test_depend>")
    add(tmp_path, "d")
    assert names(tmp_path) == ["d", "c", "b", "a"]


@pytest.mark.parametrize(("condition", "variables", "is_needed"), [
    ("$ROS_PYTHON_VERSION == 3", {}, True), ("$ROS_PYTHON_VERSION == 2", {}, False),
    ("$ROS_DISTRO == noetic and $ROS_VERSION == 1", {}, True),
    ("$ROS_DISTRO == noetic", {"ROS_DISTRO": "melodic"}, False),
    ("$WITH_ARM == yes", {"WITH_ARM": "yes"}, True), ("$WITH_ARM == yes", {}, False),
])  # fmt: skip
def test_conditions_decide_what_a_package_depends_on(
    tmp_path: Path, condition: str, variables: dict[str, str], is_needed: bool
) -> None:
    add(tmp_path, "a", f'<depend condition="{condition}">b</depend>')
    add(tmp_path, "b")
    packages = {package.name: package for package in read_source_space(tmp_path, variables).packages}
    assert packages["a"].all_dependencies == ({"b"} if is_needed else set())


def test_dependencies_are_listed_by_kind(tmp_path: Path) -> None:
    add(tmp_path, "a", "<depend>x</depend><exec_depend>y</exec_depend><test_depend>z</test_depend>")
    (package,) = read_source_space(tmp_path, {}).packages
    assert package.dependencies("build_depends") == {"x"}
    assert package.dependencies("exec_depends") == {"x", "y"}
    assert package.dependencies("test_depends", "build_export_depends") == {"x", "z"}
    assert not package.is_metapackage


def test_the_closure_has_direct_and_indirect_dependencies(tmp_path: Path) -> None:
    add(tmp_path, "a", "<depend>b</depend>")
    add(tmp_path, "b", "<depend>c</depend><depend>elsewhere</depend>")
    add(tmp_path, "c")
    add(tmp_path, "other")
    packages = read_source_space(tmp_path, {}).packages
    assert (closure(packages, {"a"}), closure(packages, {"c", "nope"})) == ({"a", "b", "c"}, {"c"})
    assert closure(packages, set()) == set()


def test_metapackages_are_built_and_dry_packages_are_not(tmp_path: Path) -> None:
    add(tmp_path, "all_of_them", "<export><metapackage/></export>")
    (tmp_path / "dry").mkdir()
    (tmp_path / "dry" / "manifest.xml").write_text("<package/>")
    (package,) = read_source_space(tmp_path, {}).packages
    assert package.is_metapackage


@pytest.mark.parametrize(("manifest", "complaint"), [
    ("<package", "package.xml:1:"),
    ("<package format='2'>\n<name>x</name>\n<oops>\n</package>", "package.xml:4:"),
    ("<package format='2'><name>x</name></package>", "package.xml:1:"),
    (
        "<package format='9'><name>x</name></package>",
        "package.xml:1:1: format must be 1, 2 or 3, got [9]",
    ),
    ("<package format='two'/>", "format must be 1, 2 or 3, got [two]"), ("<other/>", "package.xml"),
    ("<!DOCTYPE x []><package/>", "package.xml:1:"),
    (MANIFEST.format(name="bad", rest="<depend>x</depend>" * 997), "at most 1000 elements, got 1002"),
])  # fmt: skip
def test_a_broken_manifest_is_reported_with_its_place(tmp_path: Path, manifest: str, complaint: str) -> None:
    add(tmp_path, "good")
    add(tmp_path, "bad")
    (tmp_path / "bad" / "package.xml").write_text(manifest)
    space = read_source_space(tmp_path, {})
    assert [package.name for package in space.packages] == ["good"]
    (error,) = space.errors
    assert complaint in error


@pytest.mark.parametrize("circle", [("a", "b"), ("a", "b", "c")])
def test_a_circle_is_named(tmp_path: Path, circle: tuple[str, ...]) -> None:
    for name, needed in zip(circle, (*circle[1:], circle[0]), strict=True):
        add(tmp_path, name, f"<depend>{needed}</depend>")
    space = read_source_space(tmp_path, {})
    assert not space.packages
    assert f"the packages {', '.join(circle)} depend on each other" in "".join(space.errors)


def test_one_name_for_two_packages_is_refused_with_both_folders(tmp_path: Path) -> None:
    folders = [add(tmp_path, "a", folder=folder) for folder in ("one", "two")]
    (error,) = read_source_space(tmp_path, {}).errors
    assert all(str(folder) in error for folder in folders)

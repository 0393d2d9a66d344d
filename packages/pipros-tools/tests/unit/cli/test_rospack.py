from pathlib import Path

import pytest

from pipros_tools.cli import rospack


def add(folder: Path, name: str, content: str = "") -> Path:
    package = folder / name
    package.mkdir(parents=True)
    (package / "package.xml").write_text(f"<package><name>{name}</name>{content}</package>")
    return package


@pytest.fixture(autouse=True)
def source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Packages a -> b -> c, with a build dependency, a system library, a plugin, and one in two places."""
    folder = tmp_path / "src"
    add(
        folder,
        "a",
        "<build_depend>d</build_depend><depend>b</depend><exec_depend>boost</exec_depend>"
        '<exec_depend condition="$ROS_PYTHON_VERSION == 2">c</exec_depend>',
    )
    add(folder, "b", '<run_depend>c</run_depend><export><c plugin="${prefix}/p.xml"/></export>')
    add(folder, "c")
    add(folder, "d")
    add(folder / "again", "d")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(folder))
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path)
    return folder


def ask(capsys: pytest.CaptureFixture[str], *words: str) -> list[str]:
    assert rospack.main(words) == 0
    return capsys.readouterr().out.splitlines()


@pytest.mark.parametrize(("words", "answer"), [
    (["depends1", "a"], ["b"]), (["depends", "a"], ["c", "b"]), (["deps", "a"], ["c", "b"]),
    (["depends-indent", "a"], ["b", "  c"]), (["depends-on1", "c"], ["b"]),
    (["depends-on", "c"], ["b", "a"]),
    (["depends-why", "--target=c", "a"], ["Dependency chains from a to c:", "* a -> b -> c "]),
    (["depends-why", "--target", "a", "c"], ["Dependency chains from c to a:"]),
    (["rosdep0", "a"], ["name: b", "name: boost", "name: d"]),
    (["rosdep", "a"], ["name: b", "name: boost", "name: c", "name: d"]), (["vcs", "a"], []),
])  # fmt: skip
def test_queries_of_dependencies(words: list[str], answer: list[str], capsys) -> None:
    assert ask(capsys, *words) == answer


def test_find_prints_the_folder(source: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert ask(capsys, "find", "a") == [str(source / "a")]


def test_the_package_of_the_current_folder_is_the_default(source: Path, capsys, monkeypatch) -> None:
    monkeypatch.chdir(source / "b")
    assert ask(capsys, "depends1") == ["c"]


def test_list_and_list_names(source: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert f"b {source}/b" in ask(capsys, "list")
    assert {"a", "b", "c", "d", "std_msgs"} <= set(ask(capsys, "list-names"))


def test_duplicates_are_listed_with_their_folders(source: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert ask(capsys, "list-duplicates") == ["d", f"- {source}/again/d", f"- {source}/d"]


def test_plugins_are_found_by_their_export(source: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert ask(capsys, "plugins", "--attrib=plugin", "c") == [f"b {source}/b/p.xml"]
    assert ask(capsys, "plugins", "--attrib=plugin", "--top=c", "c") == []


def test_profile_lists_folders_by_their_cost(source: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = ask(capsys, "profile", "--length=3")
    assert lines[0].startswith("Full tree crawl took ")
    assert len(lines) == 9


@pytest.mark.parametrize(("words", "complaint"), [
    (["find", "nope"], "package 'nope' not found"), (["find"], "no package given"),
    (["nope"], "command nope not implemented"), (["find", "a", "b"], "too many positional options"),
    (["depends-why", "a"], "no package or target given"),
    (["find", "--nope"], "unrecognised option '--nope'"), (["cflags-only-I", "a"], "pkg-config"),
    (["list", "a"], "invalid option(s) given"), (["profile", "a"], "invalid option(s) given"),
    (["find", "--top=a", "a"], "invalid option(s)"), (["deps", "--length=2", "a"], "invalid option(s)"),
])  # fmt: skip
def test_invalid_queries_exit_with_1(words: list[str], complaint: str, capsys) -> None:
    assert rospack.main(words) == 1
    captured = capsys.readouterr()
    assert captured.err.startswith("[rospack] Error: ")
    assert complaint in captured.err
    for quiet in ("-q", "--quiet"):
        assert (rospack.main([quiet, *words]), capsys.readouterr().err) == (1, "")


def test_packages_that_need_each_other_are_reported(source: Path, capsys: pytest.CaptureFixture[str]) -> None:
    add(source, "x", "<exec_depend>y</exec_depend>")
    add(source, "y", "<exec_depend>x</exec_depend>")
    assert rospack.main(["depends", "x"]) == 1
    assert "package 'x' depends on itself: x -> y -> x" in capsys.readouterr().err


def test_a_broken_manifest_is_named_with_its_line(source: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (source / "c" / "package.xml").write_text("<package>\n<name>c</name")
    assert rospack.main(["depends", "a"]) == 1
    assert f"{source}/c/package.xml:2:" in capsys.readouterr().err

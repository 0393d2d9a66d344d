import os
import time
from pathlib import Path

import pytest

from pipros.basics.env import Environment
from pipros.basics.errors import NotFound
from pipros.basics.windows import ON_WINDOWS
from pipros.msg.language.definition_files import DefinitionFiles
from pipros.packages import ImportablePackages
from pipros.packages import crawl as crawling
from pipros.packages.installed_packages import share_folders
from pipros.packages.system_packages import SYSTEM_SHARE
from pipros.safe.xml import XmlError
from pipros_workspace.crawl_times import crawl_times
from pipros_workspace.index import SHIPPED_FOLDERS, Package, PackageIndex
from pipros_workspace.manifest import read_manifest


def add_package(folder: Path, name: str | None = None) -> Path:
    folder.mkdir(parents=True)
    (folder / "package.xml").write_text(f"<package><name>{name or folder.name}</name></package>")
    return folder


def age(folder: Path, changed_s: float = 1_000_000_000) -> None:
    """Make everything below `folder` old enough for its times to be trusted, or set another time."""
    for path in (folder, *folder.rglob("*")):
        os.utime(path, (changed_s, changed_s))


def test_a_package_is_found_by_the_name_in_its_manifest(tmp_path: Path) -> None:
    place = add_package(tmp_path / "folder_of_another_name", "talkers")
    assert PackageIndex([tmp_path]).find("talkers") == Package("talkers", place)


@pytest.mark.parametrize("manifest", [
    "<package><name>two words</name><name>right</name>", "<name><b>bold</b></name><name>\n right\t</name>",
    "<!-- <name>a</name> --><!----><name>right</name><!-- <name>b</name>",
    "<!-- never closed <name>right</name>", "<na<!-- -->me>right</name>",
    "<package><!-- <name>old</name> --><name> right </name></package>",
])  # fmt: skip
def test_the_name_is_found_in_unusual_manifests_and_not_in_comments(tmp_path: Path, manifest: str) -> None:
    add_package(tmp_path / "folder")
    (tmp_path / "folder" / "package.xml").write_text(manifest)
    assert [package.name for package in PackageIndex([tmp_path])] == ["right"]


def test_a_package_without_a_name_has_that_of_its_folder(tmp_path: Path) -> None:
    add_package(tmp_path / "broken")
    (tmp_path / "broken" / "package.xml").write_text("<package")
    assert PackageIndex([tmp_path]).find("broken").path == tmp_path / "broken"


def test_the_earlier_folder_wins_and_the_duplicate_is_listed(tmp_path: Path) -> None:
    first, second = add_package(tmp_path / "overlay" / "p"), add_package(tmp_path / "underlay" / "p")
    index = PackageIndex([tmp_path / "overlay", tmp_path / "underlay"])
    assert (index.find("p").path, index.duplicates()) == (first, {"p": [first, second]})


def test_packages_are_not_nested(tmp_path: Path) -> None:
    add_package(tmp_path / "outer")
    add_package(tmp_path / "outer" / "inner")
    assert [package.name for package in PackageIndex([tmp_path])] == ["outer"]


@pytest.mark.parametrize("marker", ["CATKIN_IGNORE", "COLCON_IGNORE", "rospack_nosubdirs"])
def test_a_marked_folder_is_skipped(tmp_path: Path, marker: str) -> None:
    add_package(tmp_path / "marked" / "p")
    (tmp_path / "marked" / marker).touch()
    assert "p" not in PackageIndex([tmp_path])


def test_an_ignored_package_is_not_found(tmp_path: Path) -> None:
    (add_package(tmp_path / "p") / "CATKIN_IGNORE").touch()
    assert list(PackageIndex([tmp_path])) == []


def test_hidden_folders_are_passed_over(tmp_path: Path) -> None:
    add_package(tmp_path / ".git" / "p")
    assert "p" not in PackageIndex([tmp_path])


def test_a_link_that_leads_back_ends_the_walk(tmp_path: Path) -> None:
    place = add_package(tmp_path / "a" / "p")
    (tmp_path / "a" / "loop").symlink_to(tmp_path)
    assert [package.path for package in PackageIndex([tmp_path])] == [place]


def test_an_unknown_package_is_refused_with_the_folders_that_were_searched(tmp_path: Path) -> None:
    with pytest.raises(NotFound, match=r"package \[nope\] not found") as refusal:
        PackageIndex([tmp_path / "one", tmp_path / "two"]).find("nope")
    assert str(tmp_path / "two") in str(refusal.value)


def test_a_folder_that_is_given_twice_is_searched_and_shown_once(tmp_path: Path) -> None:
    add_package(tmp_path / "p")
    path = (SHIPPED_FOLDERS[0], tmp_path, *SHIPPED_FOLDERS)  # as after sourcing a setup file
    index = PackageIndex.from_environment(Environment(package_path=path))

    installed = map(Path, share_folders())
    system = [] if ON_WINDOWS else [Path(SYSTEM_SHARE)]
    assert index.folders == (SHIPPED_FOLDERS[0], tmp_path, *installed, *SHIPPED_FOLDERS[1:], *system)
    assert index.duplicates() == {}
    with pytest.raises(NotFound) as refusal:
        index.find("nope")
    assert str(refusal.value).count(str(SHIPPED_FOLDERS[0])) == 1


def test_windows_has_no_folder_of_debian(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("pipros.packages.system_packages", "pipros_workspace.index"):
        monkeypatch.setattr(f"{module}.ON_WINDOWS", True)
    index = PackageIndex.from_environment(Environment(package_path=()))
    assert Path(SYSTEM_SHARE) not in index.folders
    assert index.advice == (
        r"ROS_PACKAGE_PATH lists no workspace: run devel\setup.bat of the workspace, "
        "or set ROS_PACKAGE_PATH to the folder of its packages"
    )
    for module in ("pipros_workspace.index", "pipros.packages.well_known"):
        monkeypatch.setattr(f"{module}.SETUP_FILE", r"devel\setup.bat")
    for find in (index.find, DefinitionFiles(ImportablePackages().find).folder):
        with pytest.raises(NotFound, match=r"is .*devel\\setup\.bat.* sourced"):
            find("nope")
    place = add_package(tmp_path / "found_there")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    assert ImportablePackages().find("found_there") == str(place)


def test_a_package_that_was_added_later_is_noticed(tmp_path: Path) -> None:
    index = PackageIndex([tmp_path])
    assert index.get("late") is None
    add_package(tmp_path / "deep" / "late")
    assert index.find("late").path == tmp_path / "deep" / "late"


def test_the_package_around_a_file_is_found(tmp_path: Path) -> None:
    place = add_package(tmp_path / "p", "named")
    (place / "scripts").mkdir()
    index = PackageIndex([tmp_path])
    assert index.containing(place / "scripts" / "x.py") == Package("named", place)
    assert index.containing(tmp_path) is None


def test_the_environment_lists_its_folders_before_the_shipped_packages(tmp_path: Path) -> None:
    place = add_package(tmp_path / "std_msgs")
    index = PackageIndex.from_environment(Environment(package_path=(tmp_path,), ros_home=tmp_path / "home"))
    assert index.find("std_msgs").path == place


def many_packages(folder: Path) -> None:
    for number in range(50):
        add_package(folder / f"p{number}")
    age(folder)


def test_a_large_folder_is_answered_from_the_cache_while_nothing_changes(tmp_path: Path) -> None:
    root, cache = tmp_path / "root", tmp_path / "cache"
    many_packages(root)
    assert len(list(PackageIndex([root], cache_folder=cache))) == 50
    (stored,) = cache.iterdir()
    stored.write_text(stored.read_text().replace("\tp7\twet\n", "\tfrom_the_cache\twet\n"))
    assert "from_the_cache" in PackageIndex([root], cache_folder=cache)


def test_a_package_in_a_cached_folder_is_valid_while_its_manifest_is_unchanged(tmp_path: Path) -> None:
    root, cache = tmp_path / "root", tmp_path / "cache"
    many_packages(root)
    list(PackageIndex([root], cache_folder=cache))
    (root / "p3" / "package.xml").write_text("<package><name>renamed</name></package>")

    assert PackageIndex([root], cache_folder=cache).find("p7").path == root / "p7"
    assert PackageIndex([root], cache_folder=cache).get("p3") is None
    assert PackageIndex([root], cache_folder=cache).find("renamed").path == root / "p3"


def test_the_list_is_correct_after_a_look_up_in_an_outdated_cache(tmp_path: Path) -> None:
    root, cache = tmp_path / "root", tmp_path / "cache"
    many_packages(root)
    list(PackageIndex([root], cache_folder=cache))
    add_package(root / "new")
    index = PackageIndex([root], cache_folder=cache)

    assert index.find("p7").path == root / "p7"
    assert "new" in {package.name for package in index}


def test_a_package_in_an_earlier_folder_precedes_one_in_a_later_cached_folder(tmp_path: Path) -> None:
    early, late, cache = tmp_path / "early", tmp_path / "late", tmp_path / "cache"
    many_packages(late)
    many_packages(early)
    list(PackageIndex([early, late], cache_folder=cache))
    index = PackageIndex([early, late], cache_folder=cache)
    assert index.find("p7").path == early / "p7"

    (early / "p7" / "package.xml").unlink()
    assert PackageIndex([early, late], cache_folder=cache).find("p7").path == late / "p7"


@pytest.mark.parametrize("change", ["new package", "gone package", "other name", "damaged cache"])
def test_every_change_invalidates_the_cache(tmp_path: Path, change: str) -> None:
    root, cache = tmp_path / "root", tmp_path / "cache"
    many_packages(root)
    list(PackageIndex([root], cache_folder=cache))
    expected = {f"p{number}" for number in range(50)}
    if change == "new package":
        add_package(root / "new")
        expected.add("new")
    elif change == "gone package":
        (root / "p3" / "package.xml").unlink()
        expected.remove("p3")
    elif change == "other name":
        (root / "p3" / "package.xml").write_text("<package><name>renamed</name></package>")
        expected = expected - {"p3"} | {"renamed"}
    else:
        next(cache.iterdir()).write_text("1\n?")
    assert {package.name for package in PackageIndex([root], cache_folder=cache)} == expected


def test_an_unwritable_cache_is_skipped(tmp_path: Path) -> None:
    root = tmp_path / "root"
    many_packages(root)
    (tmp_path / "file").touch()
    assert len(list(PackageIndex([root], cache_folder=tmp_path / "file" / "below"))) == 50


def test_a_crawl_of_recently_changed_folders_is_not_current(tmp_path: Path) -> None:
    add_package(tmp_path / "p")
    age(tmp_path, time.time() + 3600)  # recent, however slow the test is
    assert not crawling.crawl(str(tmp_path)).is_current()
    age(tmp_path)
    assert crawling.crawl(str(tmp_path)).is_current()


def test_a_crawl_survives_a_round_trip(tmp_path: Path) -> None:
    add_package(tmp_path / "with blanks" / "pä")
    found = crawling.crawl(str(tmp_path))
    text = crawling.dump(found)
    assert text is not None
    again = crawling.load(text, str(tmp_path))
    assert again is not None
    assert crawling.dump(again) == text
    assert crawling.load(text, "/elsewhere") is None


META = "<package><name>all_robots</name><version>1.2.3</version><export><metapackage/></export></package>"
DRY = (
    '<package><depend package="rospy"/><!-- <depend package="no"/> --><export><cpp x="y"/></export></package>'
)


def test_dry_packages_have_the_names_of_their_folders(tmp_path: Path) -> None:
    for folder in ("old_robot", "old_robot/inner", "stack/arm"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "manifest.xml").write_text(DRY)
    add_package(tmp_path / "both", "new_name")
    (tmp_path / "both" / "manifest.xml").write_text(DRY)

    index = PackageIndex([tmp_path])

    assert [package.name for package in index] == ["arm", "new_name", "old_robot"]
    assert index.find("arm").manifest_file == tmp_path / "stack/arm/manifest.xml"
    assert index.find("new_name").manifest_file == tmp_path / "both/package.xml"
    assert index.containing(tmp_path / "old_robot" / "inner") == Package(
        "inner", tmp_path / "old_robot" / "inner"
    )
    manifest = read_manifest(tmp_path / "old_robot")
    assert (manifest.name, manifest.version) == ("old_robot", "")
    assert manifest.depends() == ["rospy"]
    assert [export.tag for export in manifest.exports] == ["cpp"]


def test_metapackages_are_found_only_on_request(tmp_path: Path) -> None:
    folder = add_package(tmp_path / "all_robots")
    (folder / "package.xml").write_text(META)
    add_package(tmp_path / "robot")

    index = PackageIndex([tmp_path])

    assert [package.name for package in index] == ["robot"]
    assert index.get("all_robots") is None
    stacks = PackageIndex([tmp_path], kinds=crawling.STACKS)
    assert stacks.get("all_robots") == Package("all_robots", folder)
    assert [package.name for package in stacks] == ["all_robots", "robot"]


@pytest.mark.parametrize("change", ["package.xml is added", "manifest.xml is removed"])
def test_a_dry_package_that_changes_is_noticed(tmp_path: Path, change: str) -> None:
    folder = tmp_path / "root" / "robot"
    folder.mkdir(parents=True)
    (folder / "manifest.xml").write_text(DRY)
    age(tmp_path)
    found = crawling.crawl(str(tmp_path))
    assert found.is_current()
    if change == "package.xml is added":
        (folder / "package.xml").write_text("<package><name>wet</name></package>")
    else:
        (folder / "manifest.xml").unlink()
    assert not found.is_current()


def write(folder: Path, content: str, name: str = "package.xml") -> Path:
    folder.mkdir(exist_ok=True)
    (folder / name).write_text(content)
    return folder


def test_name_version_and_description_are_trimmed(tmp_path: Path) -> None:
    manifest = read_manifest(
        write(tmp_path,
            "<package><name> p </name><version>\n1.2.3</version><description>a\n  b</description></package>"),
    )  # fmt: skip
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

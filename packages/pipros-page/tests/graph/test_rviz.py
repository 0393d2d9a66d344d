"""The command `rviz`: its file, its services, and the data of the scene."""

import gzip
import http.client
import zlib
from pathlib import Path

import pytest

from pipros_page.scene.layout_file import read_rviz
from tests.support.page import Page
from tests.support.ros import RosSystem

MINIMAL = "Visualization Manager:\n  Displays: []\n  Global Options:\n    Fixed Frame: odom\n  Later: 007\n"


@pytest.fixture
def home(tmp_path: Path) -> Path:
    (tmp_path / ".rviz").mkdir()
    (tmp_path / ".rviz" / "mine.rviz").write_text(MINIMAL)
    return tmp_path


@pytest.fixture(scope="module")
def page(shared_ros: RosSystem) -> Page:
    """The page of a master, for tests that do not load or save a file."""
    shared_ros.serve_master()
    return Page(shared_ros, command="rviz")


def test_a_file_is_shown_and_saved_with_control(ros: RosSystem, home: Path) -> None:
    ros.serve_master()
    file = home / ".rviz" / "mine.rviz"
    page = Page(ros, "-d", file, "-f", "base_link", "--control", command="rviz")
    assert page.place == "scene"
    with page.connect() as browser:
        shown = next(browser.watch("scene_config"))
        assert (shown["path"], shown["fixed_frame"]) == (str(file), "base_link")
        assert shown["config"]["Visualization Manager"]["Later"] == "007"
        shown["config"]["Visualization Manager"]["Global Options"]["Fixed Frame"] = "map"
        assert browser.act("scene_save", config=shown["config"]) == str(file)
    assert read_rviz(file.read_bytes()) == shown["config"]


def test_without_control_nothing_is_saved(ros: RosSystem, home: Path) -> None:
    ros.serve_master()
    page = Page(ros, "-d", "mine", command="rviz", HOME=str(home))
    with page.connect() as browser:
        shown = next(browser.watch("scene_config"))
        assert shown["config"]["Visualization Manager"]["Global Options"]["Fixed Frame"] == "odom"
        assert "--control" in browser.act("scene_save", config=shown["config"])["error"]
    done = ros.pipros.run("rosservice", "call", "/view/save_config", "path: {data: a}")
    assert "True" not in done.stdout
    assert (home / ".rviz" / "mine.rviz").read_text() == MINIMAL


def test_services_load_files_of_rviz_only(ros: RosSystem, home: Path) -> None:
    ros.serve_master()
    page = Page(ros, "__name:=view", command="rviz", HOME=str(home))
    with page.connect() as browser:
        configs = browser.watch("scene_config")
        assert next(configs)["path"] == str(home / ".rviz" / "default.rviz")
        path = home / ".rviz" / "mine.rviz"
        for name, answer in ((home / "mine.rviz", "False"), (path, "True")):
            done = ros.pipros.run("rosservice", "call", "/view/load_config", f"path: {{data: {name}}}")
            assert f"success: {answer}" in done.stdout
        assert next(configs)["path"] == str(path)


def test_a_missing_file_is_an_error(ros: RosSystem) -> None:
    done = ros.pipros.run("rviz", "-d", "/nowhere/a.rviz")
    assert (done.returncode, done.stderr) == (1, ["ERROR: cannot read /nowhere/a.rviz: no such file"])


def test_resources_come_from_packages_only(page: Page) -> None:
    with page.connect() as browser:
        for uri in ("file:///etc/passwd", "package://rviz/default.rviz", "package://rviz/../a.stl"):
            assert "error" in next(browser.watch("scene_resource", uri=uri))


def test_a_robot_is_shown_as_soon_as_it_is_set(shared_ros: RosSystem, page: Page) -> None:
    with page.connect() as browser:
        robots = browser.watch("scene_robot", name="robot_description")
        assert next(robots) == {
            "error": "Parameter [robot_description] does not exist, and was not found by searchParam()"
        }
        shared_ros.pipros.run("rosparam", "set", "/robot_description", "<robot><link name='a'/></robot>")
        assert next(robots) == {"links": [{"name": "a", "visuals": [], "collisions": []}]}


def test_messages_arrive_with_their_layout(shared_ros: RosSystem, page: Page) -> None:
    point = ("/point", "geometry_msgs/PointStamped", "{point: {x: 2}}")
    shared_ros.pipros.start("rostopic", "pub", "-l", *point)
    with page.connect() as browser:
        answers = browser.watch("scene_messages", name="/point", queue=5)
        answer = next(value for value in answers if isinstance(value, bytes) or value["layout"])
        assert answer["layout"]["type"] == "geometry_msgs/PointStamped"
        senders = next(answers)["senders"]
        assert [name.startswith("/rostopic_") for name in senders] == [True]
        batch = next(value for value in answers if isinstance(value, bytes))
        assert (batch[0], batch[13:15]) == (0, b"\x01\x00")
        assert batch[15:].endswith(b"\x00\x00\x00\x00\x00\x00\x00\x40" + bytes(16))


@pytest.mark.parametrize("path", ["/", "/bundle/three.js", "/live.js"])
def test_files_are_compressed_and_kept_by_browsers(page: Page, path: str) -> None:
    first = page.get(path, **{"Accept-Encoding": "gzip"})
    body = first.read()
    assert first.headers["Content-Encoding"] == "gzip"
    assert len(body) < len(gzip.decompress(body)) / 2
    assert gzip.decompress(body) == page.get(path).read()
    again = page.get(path, **{"If-None-Match": str(first.headers["ETag"])})
    assert (again.status, again.read()) == (http.client.NOT_MODIFIED, b"")
    assert again.headers["Cache-Control"] == "no-cache"  # browsers ask each time


def test_large_batches_are_compressed_on_request(shared_ros: RosSystem, page: Page, tmp_path: Path) -> None:
    file = tmp_path / "text.yaml"
    file.write_text(f"data: {'a' * 300_000}\n")
    shared_ros.pipros.start("rostopic", "pub", "-l", "-f", file, "/text", "std_msgs/String")
    for is_compressed in (True, False):
        with page.connect() as browser:
            answers = browser.watch("scene_messages", name="/text", queue=5, deflate=is_compressed)
            batch = next(value for value in answers if isinstance(value, bytes))
        assert batch[0] == is_compressed
        body = zlib.decompress(batch[1:]) if is_compressed else batch[1:]
        assert body[14:] == (300_000).to_bytes(4, "little") + b"a" * 300_000

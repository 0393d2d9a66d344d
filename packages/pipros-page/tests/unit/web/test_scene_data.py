"""Data of the scene: layouts of messages, columns of clouds, queues, and the files that services may use."""

import asyncio
import contextlib
import struct
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.msg import load_message_class
from pipros.node.any_msg import AnyMsg
from pipros_libraries.pictures.cloud_columns import cloud_columns, point_columns, strided, thinning_step
from pipros_page.messages.layout import message_layout
from pipros_page.scene.layout_file import SceneFile
from pipros_page.scene.services import permitted_path
from pipros_page.scene.topic import PendingMessages, SceneTopic
from pipros_page.shared import Shared
from pipros_page.topic_watch import Newest, TopicWatch
from pipros_page.views.scene import LEAST_POINTS, CloudTopic, SceneViews, fitting_points
from pipros_page.views.scene_robots import DESCRIPTIONS, read_named_file
from pipros_page.watched_system import WatchedSystem
from pipros_server.daemon_pool import DaemonPool
from pipros_server.view_server import RequestRefused
from pipros_tools.graph.raw_decoder import RawDecoder
from tests.support.full_disk import files_limited_to

MINIMAL = "Visualization Manager:\n  Displays: []\n"


def field(name: str, offset: int, datatype: int = 7) -> SimpleNamespace:
    return SimpleNamespace(name=name, offset=offset, datatype=datatype, count=1)


def cloud(rows: list[tuple[float, ...]], size: int, fields: list[SimpleNamespace]) -> SimpleNamespace:
    data = b"".join(struct.pack(f"<{len(row)}f", *row).ljust(size, b"\xff") for row in rows)
    return SimpleNamespace(width=len(rows), height=1, point_step=size, data=data, fields=fields)


XYZ = [field("x", 0), field("y", 4), field("z", 8)]


def test_a_layout_names_fields_types_and_array_lengths() -> None:
    marker = load_message_class("visualization_msgs/Marker")
    layout = message_layout("visualization_msgs/Marker", marker._full_text)
    assert layout["geometry_msgs/Point"] == [[name, "float64", -1] for name in "xyz"]
    assert ["points", "geometry_msgs/Point", 0] in layout["visualization_msgs/Marker"]
    odometry = load_message_class("geometry_msgs/PoseWithCovariance")
    fixed = message_layout("geometry_msgs/PoseWithCovariance", odometry._full_text)
    assert ["covariance", "float64", 37] in fixed["geometry_msgs/PoseWithCovariance"]


@pytest.mark.parametrize(
    ("text", "reason"), [("a_msgs/Missing m", "lacks the type"), ("a_msgs/Self s", "contains itself")]
)
def test_layouts_of_broken_definitions_are_refused(text: str, reason: str) -> None:
    with pytest.raises(PiprosError, match=reason):
        message_layout("a_msgs/Self", text)


def test_columns_are_taken_from_unaligned_rows() -> None:
    found = cloud_columns(cloud([(1, 2, 3), (4, 5, 6)], 13, XYZ), ["intensity"], 100)
    assert [struct.unpack("<2f", column.data) for column in found.columns] == [(1, 4), (2, 5), (3, 6)]
    assert (found.count, found.step, found.problem) == (2, 1, "")


def test_large_clouds_are_thinned_and_begin_at_another_point_each_time() -> None:
    rows = [(float(number), 0.0, 0.0) for number in range(10)]
    seen = set()
    for turn in range(5):
        found = cloud_columns(cloud(rows, 12, XYZ), [], 2, turn)
        assert found.step == 5
        seen |= set(struct.unpack("<2f", found.columns[0].data))
    assert seen == set(map(float, range(10)))


def test_a_cloud_of_another_size_is_reported_with_rviz_s_text() -> None:
    wrong = cloud([(1, 2, 3)], 16, XYZ)
    wrong.width = 2
    expected = "Data size (16 bytes) does not match width (2) times height (1) times point_step (16).  "
    assert cloud_columns(wrong, [], 10).problem == expected + "Dropping message."


@pytest.mark.parametrize("fields", [
    XYZ[:2], [field("x", 0, 8), *XYZ[1:]], [field("x", 1000), *XYZ[1:]], [field("x", 0, 99), *XYZ[1:]]
])  # fmt: skip
def test_clouds_without_usable_positions_are_reported(fields: list[SimpleNamespace]) -> None:
    assert cloud_columns(cloud([(1, 2, 3)], 12, fields), [], 10).problem


def test_channels_of_old_clouds_are_columns() -> None:
    points = [SimpleNamespace(x=float(number), y=1.0, z=2.0) for number in range(3)]
    channels = [
        SimpleNamespace(name="intensity", values=[7.0, 8.0, 9.0]),
        SimpleNamespace(name="u", values=[]),
    ]
    old = SimpleNamespace(points=points, channels=channels)
    found = point_columns(old, ["intensity"], 2, turn=1)
    assert (found.count, found.step) == (3, 3)
    assert [struct.unpack("<f", column.data) for column in found.columns] == [(1,), (1,), (2,), (8,)]
    assert point_columns(old, ["u"], 10).problem == "Channel [u] has 0 values for 3 points"


def test_an_empty_cloud_has_empty_columns() -> None:
    assert [column.data for column in cloud_columns(cloud([], 12, XYZ), [], 10).columns] == [b""] * 3


def test_strides_and_steps() -> None:
    assert strided(b"abcdef", 4, 3, 2) == b"ef"
    assert [thinning_step(count, 100) for count in (0, 100, 101, 400)] == [1, 1, 3, 5]


@pytest.mark.parametrize(("points", "sent_s", "expected"), [
    (100_000, 0.05, 125_001), (190_000, 0.0, 200_000), (100_000, 0.3, 100_000), (100_000, 4.0, 10_000),
    (1000, 60.0, LEAST_POINTS), (1, 60.0, 1), (1, 0.0, 2),
])  # fmt: skip
def test_a_slow_link_gets_fewer_points(points: int, sent_s: float, expected: int) -> None:
    assert fitting_points(points, 200_000, sent_s) == expected


def test_a_cloud_is_packed_once_for_all_viewers_of_the_same_points() -> None:
    found = cloud([(number, 0.0, 0.0) for number in range(6)], 12, XYZ)
    found.header = load_message_class("std_msgs/Header")()
    decoded: list[AnyMsg] = []

    def decode_as(message: AnyMsg, _: type) -> Any:
        decoded.append(message)
        return found

    clouds = CloudTopic(SimpleNamespace(decode_as=decode_as), DaemonPool("computation", 2))
    raw = message(b"", "/camera", is_latched=False)

    async def pack() -> list[bytes]:
        first, second = Newest(1, raw, 0.0), Newest(2, raw, 0.0)
        same = await asyncio.gather(clouds.packed(first, (), 6), clouds.packed(first, (), 6))
        return [*same, await clouds.packed(first, (), 3), await clouds.packed(second, (), 6)]

    one, other, fewer, next_one = asyncio.run(pack())
    assert one is other
    assert len(fewer) < len(one)
    assert next_one is not one
    assert len(decoded) == 3


def test_clouds_become_smaller_until_two_a_second_fit() -> None:
    points = 200_000
    for _ in range(20):
        points = fitting_points(points, 200_000, points * 16 / 1_250_000)
    assert 0.3 < points * 16 / 1_250_000 <= 0.4


def message(body: bytes, sender: str, *, is_latched: bool) -> AnyMsg:
    made = AnyMsg(body)
    made._connection_header = {
        "callerid": sender, "latching": "1" if is_latched else "0", "type": "std_msgs/String",
        "message_definition": "string data", "md5sum": "1",
    }  # fmt: skip
    return made


def watched_topic(history_s: float = 0.0) -> tuple[SceneTopic, TopicWatch]:
    watch = TopicWatch("/a", RawDecoder())
    topic = SceneTopic(watch, history_s)
    watch._listeners.append(topic.add)
    return topic, watch


def bodies(queue: PendingMessages) -> list[bytes]:
    return [each.body for each, _ in queue.pop_all()[0]]


def test_a_later_browser_gets_what_the_first_one_got_and_the_newest_message() -> None:
    """A view that is opened again while a bag is paused may come before the first one is closed."""
    topic, watch = watched_topic()
    watch.note(message(b"0", "/a", is_latched=False), 1.0, is_leading=True)
    for body, sender in ((b"1", "/a"), (b"2", "/a"), (b"3", "/b")):
        watch.note(message(body, sender, is_latched=True), 1.0)
    watch.note(message(b"4", "/c", is_latched=False), 2.0)
    with topic.queued(10) as first, topic.queued(10) as queue:
        assert bodies(first) == bodies(queue) == [b"0", b"2", b"3", b"4"]
        watch.note(message(b"5", "/c", is_latched=False), 3.0)
        assert bodies(queue) == [b"5"]


def test_a_later_browser_gets_the_transforms_of_the_last_seconds() -> None:
    topic, watch = watched_topic(10.0)
    for second in range(20):
        watch.note(message(b"%d" % second, "/a", is_latched=False), float(second))
    with topic.queued(1000) as queue:
        assert bodies(queue) == [b"%d" % second for second in range(9, 20)]


def test_a_layout_precedes_messages_that_arrive_while_a_browser_is_answered(monkeypatch) -> None:
    topic, _ = watched_topic()
    pop_all = PendingMessages.pop_all

    def arrive_and_pop(queue: PendingMessages) -> Any:
        if topic.layout is None:
            topic.add(message(b"1", "/a", is_latched=False), 1.0)
        return pop_all(queue)

    async def answers() -> list[Any]:
        views = SceneViews(cast(WatchedSystem, SimpleNamespace(node=SimpleNamespace(environment={}))))
        views._topics["/a"] = Shared(lambda: contextlib.nullcontext(topic))
        found = views.messages({"name": "/a"})
        return [await anext(found) for _ in range(3)]

    monkeypatch.setattr(PendingMessages, "pop_all", arrive_and_pop)
    layout, senders, batch = asyncio.run(answers())
    assert (layout, senders) == ({"layout": topic.layout}, {"senders": ["/a"]})
    assert batch.endswith(b"1")


def test_a_full_queue_drops_the_oldest_messages_and_counts_them() -> None:
    topic, _ = watched_topic()
    with topic.queued(2) as queue:
        for body in (b"1", b"2", b"3"):
            topic.add(message(body, "/a", is_latched=False), 1.0)
        messages, lost = queue.pop_all()
    assert ([each.body for each, _ in messages], lost) == ([b"2", b"3"], 1)


def test_a_broken_definition_becomes_the_layout_s_error() -> None:
    topic, _ = watched_topic()
    broken = message(b"", "/a", is_latched=False)
    broken._connection_header = {"type": "a_msgs/A", "message_definition": "nonsense", "md5sum": "2"}
    topic.add(broken, 1.0)
    assert topic.layout is not None
    assert "error" in topic.layout


def test_services_use_the_file_of_the_command_and_those_of_rviz_only(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    first = tmp_path / "mine.rviz"
    assert permitted_path(str(first), first) == first
    assert permitted_path(str(tmp_path / ".rviz/a/b.rviz"), None) == tmp_path / ".rviz/a/b.rviz"
    for path in (first, tmp_path / ".rviz/b.txt", tmp_path / ".rviz/../b.rviz"):
        with pytest.raises(PiprosError, match="must be the one given with -d"):
            permitted_path(str(path), None)


def test_files_of_robot_descriptions_are_meshes_and_their_neighbours_only(tmp_path: Path) -> None:
    for name in ("a.obj", "a.mtl", "secret.txt"):
        (tmp_path / name).write_text(name)
    (tmp_path / "link.png").symlink_to(tmp_path / "secret.txt")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "b.obj").write_text("b")
    uri = f"file://{tmp_path}"
    named = [f"{uri}/a.obj", f"{uri}/secret.txt", "package://p/c.stl"]
    assert read_named_file(f"{uri}/a.obj", named, 100) == b"a.obj"
    assert read_named_file(f"{uri}/a.mtl", named, 100) == b"a.mtl"
    for name in ("secret.txt", "link.png", "other/b.obj", "../a.obj", "missing.obj"):
        with pytest.raises(RequestRefused):
            read_named_file(f"{uri}/{name}", named, 100)
    with pytest.raises(RequestRefused):
        read_named_file(f"{uri}/a.obj", named, 1)


def test_a_file_is_saved_where_it_was_loaded_from(tmp_path: Path) -> None:
    path = tmp_path / "a.rviz"
    path.write_text(MINIMAL)
    file = SceneFile(path)
    version = file.version
    file.save({"Visualization Manager": {"Displays": [{"Class": "rviz/Grid"}]}})
    assert "rviz/Grid" in path.read_text()
    assert (file.version, list(tmp_path.iterdir())) == (version, [path])


@pytest.mark.needs("resource limits")
def test_a_full_disk_keeps_the_old_file_and_its_link(tmp_path: Path) -> None:
    (tmp_path / "a.rviz").write_text(MINIMAL)
    link = tmp_path / "b.rviz"
    link.symlink_to("a.rviz")
    file, changed = SceneFile(link), {"Visualization Manager": {"Displays": [{"Class": "rviz/Grid"}]}}

    with files_limited_to(10), pytest.raises(OSError, match=r"b\.rviz'$"):
        file.save(changed)
    assert link.read_text() == MINIMAL

    file.save(changed)
    assert link.is_symlink()
    assert "rviz/Grid" in link.read_text()


def test_without_a_file_nothing_is_saved() -> None:
    with pytest.raises(PiprosError, match="start rviz with -d FILE"):
        SceneFile().save({"Visualization Manager": {}})


# The files that a robot description names, and only these, can be read.


def description(mesh: Path) -> str:
    geometry = f'<geometry><mesh filename="file://{mesh}"/></geometry>'
    return f'<robot name="r"><link name="base"><visual>{geometry}</visual></link></robot>'


class System:
    """Stands for a watched system: parameters with robot descriptions."""

    def __init__(self) -> None:
        self.node = SimpleNamespace(environment=Environment(master_uri="http://localhost:1"))
        self.questions = self.computations = self
        self.texts: dict[str, str] = {}

    async def run(self, function: Callable[..., Any], *args: Any) -> Any:
        return self.texts[args[0]] if args[0] in self.texts and len(args) == 1 else function(*args)


def test_the_files_of_an_old_description_can_no_longer_be_read(tmp_path: Path) -> None:
    old, new, other = (tmp_path / name for name in ("a/old.stl", "b/new.stl", "c/other.stl"))
    for file in (old, new, other):
        file.parent.mkdir()
        file.write_bytes(file.name.encode())
    system: Any = System()
    views = SceneViews(system)

    async def show(name: str, mesh: Path) -> None:
        system.texts[name] = description(mesh)
        async for shown in views.robot({"name": name}):
            assert "links" in shown

    async def read(file: Path) -> bytes:
        return b"".join([data async for data in views.resource({"uri": f"file://{file}"})])

    async def body() -> None:
        await show("robot_description", old)
        await show("other_description", other)
        assert await read(old) == b"old.stl"
        await show("robot_description", new)
        assert await read(new) == b"new.stl"
        assert await read(other) == b"other.stl"
        with pytest.raises(RequestRefused):
            await read(old)
        for number in range(DESCRIPTIONS):
            await show(f"robot{number}", old)
        with pytest.raises(RequestRefused):
            await read(new)

    asyncio.run(body())

"""Interactive markers: pending changes, feedback of viewers, menus."""

from typing import Any

import pytest
from geometry_msgs.msg import Point, Pose
from std_msgs.msg import Header
from visualization_msgs.msg import InteractiveMarker, InteractiveMarkerFeedback

import rospy
from interactive_markers.menu_handler import MenuHandler
from pipros_libraries.markers.state import Markers

Feedback = InteractiveMarkerFeedback


def pose(x: float) -> Pose:
    return Pose(position=Point(x=x))


def marker(name: str, description: str = "", stamp: int = 0) -> InteractiveMarker:
    return InteractiveMarker(
        name=name, description=description, header=Header(frame_id="map", stamp=rospy.Time(stamp))
    )


@pytest.fixture
def markers() -> Markers:
    """Markers with `a` shown and `b` pending."""
    found = Markers(InteractiveMarker)
    found.insert(marker("a"))
    found.apply()
    found.insert(marker("b"))
    return found


def names(markers: Markers) -> list[list[str]]:
    changes = markers.apply()
    return [[entry.name for entry in changes.inserted], [m.name for m in changes.moved], changes.erased]


def test_changes_are_pending_until_they_are_applied(markers: Markers) -> None:
    assert list(markers.contexts) == ["a"]
    assert names(markers) == [["b"], [], []]
    assert markers.apply() is None
    assert markers.erase("a")
    assert names(markers) == [[], [], ["a"]]
    assert markers.get("a") is None


def test_a_later_change_replaces_one_that_waits(markers: Markers) -> None:
    newer = marker("b", "newer")
    markers.insert(newer)
    assert markers.get("b") is newer
    assert markers.erase("b")
    assert markers.get("b") is None
    assert names(markers) == [[], [], []]


def test_a_marker_is_moved(markers: Markers) -> None:
    assert markers.set_pose("a", pose(1), Header())
    assert markers.get("a").pose.position.x == 1
    assert markers.set_pose("a", pose(2), Header(frame_id="odom"))
    markers.pending.pop("b")

    changes = markers.apply()

    assert [(m.pose.position.x, m.header.frame_id) for m in changes.moved] == [(2, "odom")]


def test_unknown_markers_cannot_be_moved_or_erased(markers: Markers) -> None:
    assert not markers.set_pose("b", pose(1), Header())
    assert not markers.set_pose("nothing", pose(1), Header())
    assert not markers.erase("nothing")
    assert not markers.set_callback("nothing", print, None)
    markers.erase("b")
    assert not markers.set_pose("b", pose(1), Header())


def test_clear_drops_pending_updates(markers: Markers) -> None:
    markers.clear()

    assert names(markers) == [[], [], ["a"]]
    assert not markers.contexts


def feedback(name: str = "a", client: str = "viewer", kind: int = Feedback.MOUSE_UP, x: float = 0) -> Any:
    return Feedback(
        marker_name=name, client_id=client, event_type=kind, pose=pose(x), header=Header(frame_id="v")
    )


def test_callbacks_are_chosen_by_the_type_of_event(markers: Markers) -> None:
    assert markers.take_feedback(feedback(), False, 1) is None
    markers.set_callback("a", print, None)
    markers.set_callback("a", repr, Feedback.MOUSE_DOWN)

    assert markers.take_feedback(feedback(), False, 2) is print
    assert markers.take_feedback(feedback(kind=Feedback.MOUSE_DOWN), False, 3) is repr
    assert markers.take_feedback(feedback("nothing"), False, 4) is None
    markers.set_callback("a", None, Feedback.MOUSE_DOWN)
    markers.set_callback("a", None, Feedback.MOUSE_DOWN)
    assert markers.take_feedback(feedback(kind=Feedback.MOUSE_DOWN), False, 5) is print


def test_callbacks_of_a_pending_marker_are_kept_when_it_is_applied(markers: Markers) -> None:
    markers.set_callback("b", print, None)
    markers.apply()
    markers.insert(marker("b", "newer"))
    markers.apply()

    assert markers.take_feedback(feedback("b"), False, 1) is print


def test_the_first_of_two_concurrent_viewers_wins(markers: Markers) -> None:
    markers.set_callback("a", print, None)

    assert markers.take_feedback(feedback(), False, 10.0) is print
    assert markers.take_feedback(feedback(client="other"), False, 10.9) is None
    assert markers.take_feedback(feedback(), False, 10.95) is print
    assert markers.take_feedback(feedback(client="other"), False, 12.0) is print


@pytest.mark.parametrize(("stamp", "frame"), [(0, "map"), (5, "v")])
def test_a_viewer_moves_a_marker(stamp: int, frame: str) -> None:
    markers = Markers(InteractiveMarker)
    markers.insert(marker("a", stamp=stamp))
    markers.apply()

    markers.take_feedback(feedback(x=3, kind=Feedback.POSE_UPDATE), True, 1)

    changes = markers.apply()
    assert [(m.pose.position.x, m.header.frame_id) for m in changes.moved] == [(3, frame)]


def test_a_viewer_moves_a_marker_that_is_being_replaced(markers: Markers) -> None:
    markers.insert(marker("a", "newer"))

    markers.take_feedback(feedback(x=3, kind=Feedback.POSE_UPDATE), True, 1)

    assert names(markers) == [["b", "a"], [], []]
    assert (markers.get("a").description, markers.get("a").pose.position.x) == ("newer", 3)


class Server:
    """The part of a server that a menu needs."""

    def __init__(self) -> None:
        self.markers = {"a": marker("a")}
        self.inserted: list[Any] = []

    def get(self, name: str) -> InteractiveMarker | None:
        return self.markers.get(name)

    def insert(self, *arguments: Any) -> None:
        self.inserted.append(arguments)


def test_a_menu_is_put_into_markers() -> None:
    menu, server, chosen = MenuHandler(), Server(), list[Any]()
    server_of_menu: Any = server
    first = menu.insert("First", callback=chosen.append)
    second = menu.insert("Second")
    assert first is not None
    assert second is not None
    inner = menu.insert("Inner", parent=second, callback=chosen.append)
    assert inner is not None
    menu.setCheckState(first, MenuHandler.CHECKED)
    menu.setCheckState(inner, MenuHandler.UNCHECKED)

    assert menu.apply(server_of_menu, "a")
    assert not menu.apply(server_of_menu, "nothing")

    entries = [(entry.id, entry.parent_id, entry.title) for entry in server.markers["a"].menu_entries]
    assert entries == [(1, 0, "[x] First"), (2, 0, "Second"), (3, 2, "[ ] Inner")]
    menu.setVisible(second, False)
    assert menu.reApply(server_of_menu)
    assert [entry.id for entry in server.markers["a"].menu_entries] == [1]
    menu.processFeedback(Feedback(menu_entry_id=first))
    menu.processFeedback(Feedback(menu_entry_id=second))
    menu.processFeedback(Feedback(menu_entry_id=99))
    assert len(chosen) == 1
    server.markers.clear()
    assert not menu.reApply(server_of_menu)
    assert menu.reApply(server_of_menu)
    assert (menu.getTitle(inner), menu.getCheckState(inner), menu.getTitle(99)) == ("Inner", 2, None)

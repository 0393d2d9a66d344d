"""Layouts of panels: stored ones, files, perspectives of rqt."""

import json
import re
from pathlib import Path

import pytest

from pipros.basics.cache_files import Untrusted
from pipros_page.layouts import MAX_LAYOUTS, BadLayout, OpenedLayout, StoredLayouts, open_layout
from pipros_page.tabs import CONTROLS, TABS
from tests.support.environments import files_below, source
from tests.support.full_disk import files_limited_to

PANELS = "row(plot//imu/x*60~console*40)"


@pytest.fixture
def layouts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> StoredLayouts:
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "home"))
    return StoredLayouts()


def perspective(folder: Path, running: str) -> str:
    """Write a file as rqt exports it."""
    keys = {"running-plugins": {"type": "repr", "repr": running}} if running else {}
    plugins = {"plugin__rqt_top__Top__1": {"keys": {}, "groups": {"dock_widget__": {"keys": {}}}}}
    window = {"keys": {"geometry": {"type": "repr(QByteArray.hex)"}}, "groups": {}}
    groups = {"mainwindow": window, "pluginmanager": {"keys": keys, "groups": plugins}}
    file = folder / "saved.perspective"
    file.write_text(json.dumps({"keys": {}, "groups": groups}))
    return str(file)


def test_a_saved_layout_is_listed_opened_and_deleted(layouts: StoredLayouts) -> None:
    assert layouts.names() == []
    layouts.save("arm 2", PANELS)
    layouts.save("base", "graph")
    assert (layouts.names(), layouts.load("arm 2")) == (["arm 2", "base"], PANELS)
    layouts.delete("arm 2")
    assert layouts.names() == ["base"]


@pytest.mark.parametrize("name", ["", ".hidden", "../up", "a/b", "x" * 61, "a\n", 7, None])
def test_names_that_could_leave_the_folder_are_refused(layouts: StoredLayouts, name: object) -> None:
    for attempt in (layouts.load, layouts.delete, lambda each: layouts.save(each, PANELS)):
        with pytest.raises(BadLayout, match="at most 60 letters"):
            attempt(name)


@pytest.mark.parametrize("name", ["CON", "nul", "Com1", "aux.old", "LPT9 ", "prn .x"])
def test_names_that_windows_takes_for_devices_are_refused(layouts: StoredLayouts, name: str) -> None:
    with pytest.raises(BadLayout, match="Windows treats as a device"):
        layouts.save(name, PANELS)
    layouts.save(f"my {name}", PANELS)


def test_missing_and_malformed_layouts_are_named(layouts: StoredLayouts) -> None:
    with pytest.raises(BadLayout, match=r"there is no layout \[arm\]"):
        layouts.load("arm")
    with pytest.raises(BadLayout, match=r"there is no layout \[arm\]"):
        layouts.delete("arm")
    with pytest.raises(BadLayout, match="at least one panel"):
        layouts.save("arm", "")


def test_layouts_are_limited_in_size_and_number(layouts: StoredLayouts) -> None:
    with pytest.raises(BadLayout, match="the limit is 65536 bytes"):
        layouts.save("large", "x" * 70_000)
    for number in range(MAX_LAYOUTS):
        layouts.save(str(number), PANELS)
    with pytest.raises(BadLayout, match="delete one"):
        layouts.save("another", PANELS)
    layouts.save("7", "graph")
    assert layouts.load("7") == "graph"


@pytest.mark.needs("file owners")
def test_a_folder_that_others_can_write_to_is_not_used(layouts: StoredLayouts, tmp_path: Path) -> None:
    layouts.save("base", PANELS)
    (tmp_path / "home" / "pipros" / "layouts").chmod(0o777)
    for attempt in (layouts.names, lambda: layouts.load("base"), lambda: layouts.save("base", "graph")):
        with pytest.raises(Untrusted, match="writable by other users"):
            attempt()


@pytest.mark.needs("file owners")
def test_a_link_in_the_folder_is_not_followed(layouts: StoredLayouts, tmp_path: Path) -> None:
    layouts.save("base", PANELS)
    secret = tmp_path / "secret"
    secret.write_text(json.dumps({"pipros_layout": 1, "panels": "graph"}))
    (tmp_path / "home" / "pipros" / "layouts" / "linked.json").symlink_to(secret)
    with pytest.raises(Untrusted, match="symbolic link"):
        layouts.load("linked")


def test_a_stored_file_is_opened_as_it_is(layouts: StoredLayouts, tmp_path: Path) -> None:
    layouts.save("base", PANELS)
    file = tmp_path / "home" / "pipros" / "layouts" / "base.json"
    assert open_layout(str(file)) == OpenedLayout(PANELS)


def test_a_perspective_becomes_the_tabs_of_its_running_plugins(tmp_path: Path) -> None:
    running = (
        "{'rqt_plot/Plot': [1, 2], 'rqt_console/Console': [1], 'rqt_shell/Shell': [1], 'rqt_bag/Bag': []}"
    )
    opened = open_layout(perspective(tmp_path, running))
    assert opened == OpenedLayout("row(plot~plot~console)", ["rqt_shell"])


def test_many_plugins_are_arranged_in_two_rows(tmp_path: Path) -> None:
    running = "{u'rqt_plot/Plot': [1, 2, 3], u'rqt_console/Console': [1], u'rqt_graph/RosGraph': [1]}"
    opened = open_layout(perspective(tmp_path, running))
    assert opened.panels == "column(row(plot~plot~plot)~row(console~graph))"


def test_a_perspective_that_names_no_running_plugin_opens_those_with_settings(tmp_path: Path) -> None:
    assert open_layout(perspective(tmp_path, "")) == OpenedLayout("nodes", [])


def test_a_perspective_without_known_plugins_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadLayout, match="only rqt_shell, for which the page has no tab"):
        open_layout(perspective(tmp_path, "{'rqt_shell/Shell': [1]}"))


@pytest.mark.parametrize(("text", "reason"), [
    ("", "is not JSON"), ("[" * 100_000, "is not JSON"), ("[1]", "is not a layout"),
    ("{}", "neither a pipros layout nor an rqt perspective"),
    ('{"pipros_layout": 2, "panels": "graph"}', "pipros_layout must be 1"),
    ('{"pipros_layout": 1, "panels": 7}', "pipros_layout must be 1"),
    ('{"groups": 7}', "neither a pipros layout nor an rqt perspective"),
    ('{"groups": {"pluginmanager": 7}}', "no plugin"),
])  # fmt: skip
def test_other_files_are_refused(tmp_path: Path, text: str, reason: str) -> None:
    file = tmp_path / "layout.json"
    file.write_text(text)
    with pytest.raises(BadLayout, match=reason):
        open_layout(str(file))


@pytest.mark.needs("resource limits")
def test_a_full_disk_is_named_and_keeps_the_old_layout(layouts: StoredLayouts, tmp_path: Path) -> None:
    layouts.save("arm", PANELS)

    with files_limited_to(10), pytest.raises(OSError, match=r"pipros.layouts.arm\.json'$"):
        layouts.save("arm", "graph")

    assert (layouts.load("arm"), len(list(tmp_path.rglob("*arm*")))) == (PANELS, 1)


# The declarations of the page's tabs, and what the browser's modules use of them.


PAGE = source("pipros_page/page")
SOURCES = [
    file.read_text(encoding="utf-8") for file in files_below(PAGE, "*.js") if "vendor" not in file.parts
]


def used(function: str) -> set[str]:
    """Return the names with which the browser's modules call `watch` or `act`."""
    return {name for text in SOURCES for name in re.findall(rf'\b{function}\("(\w+)"', text)}


def test_no_name_belongs_to_two_tabs() -> None:
    names = [name for tab in TABS for name in (*tab.views, *tab.actions)]
    assert len(names) == len(set(names)) > 50


def test_what_changes_the_system_or_shows_messages_is_a_view_or_an_action() -> None:
    for tab in TABS:
        own = {*tab.views, *tab.actions}
        assert tab.changing.keys() | tab.of_messages <= own
        assert set(tab.controls.values()) <= tab.changing.keys()
    controlled = {name for tab in TABS for name in tab.controls}
    listed = set(re.findall(r'(?m)^  \["(\w+)", ', (PAGE / "sections.js").read_text(encoding="utf-8")))
    assert controlled - listed == {"reconfigure"}  # a section of the tab of parameters
    assert CONTROLS["services"] == "call_service"


def test_the_browser_asks_only_for_what_the_server_has() -> None:
    views, actions = used("watch"), used("act")
    assert len(views) > 25
    assert len(actions) > 20
    assert views - {name for tab in TABS for name in tab.views} == set()
    assert actions - {name for tab in TABS for name in tab.actions} == {"about"}

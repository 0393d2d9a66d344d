from __future__ import annotations

from pathlib import Path

import pytest

from pipros.packages import nodelets
from pipros_tools.launch.model import Launch, LaunchNode
from pipros_tools.launch.nodelet_choice import arguments_of, why_not_loadable, with_choices
from tests.support.debian_system import make_debian

COMPILED = {"image_proc/debayer": "image_proc", "only_cpp/C": "only_cpp"}
"""Plugins in C++. The first is also in Python, as is `image_proc/rectify`."""


def nodelet(name: str, arguments: str, **fields: object) -> LaunchNode:
    return LaunchNode("nodelet", "nodelet", name, arguments=arguments, **fields)  # type: ignore[arg-type]


def chosen_for(*plugins: str, compiled: dict[str, str] = COMPILED, **variables: str) -> tuple[set[str], str]:
    """Return the values of the variable, and the log, for a manager with nodelets."""
    loads = [nodelet(f"n{at}", f"load {plugin} m", namespace="/r/") for at, plugin in enumerate(plugins)]
    launch = Launch(nodes=(nodelet("m", "manager", namespace="/r/"), *loads, LaunchNode("a", "b", "other")))
    changed, lines = with_choices(launch, lambda: compiled, variables)
    *ours, other = [dict(node.environment).get("PIPROS_NODELETS", "") for node in changed.nodes]
    assert other == ""
    return set(ours), "\n".join(lines)


def test_a_manager_is_in_python_if_all_its_nodelets_are() -> None:
    assert chosen_for("image_proc/debayer", "image_proc/rectify") == (
        {""},
        "nodelet /r/n0 (image_proc/debayer) runs in Python\n"
        "nodelet /r/n1 (image_proc/rectify) runs in Python",
    )


def test_a_manager_is_genuine_if_one_of_its_nodelets_is_only_in_cpp() -> None:
    assert chosen_for("image_proc/debayer", "only_cpp/C") == ({"genuine"}, "")


def test_a_manager_whose_nodelets_are_not_all_installed_is_in_python() -> None:
    expected = {"ours"}, "nodelet /r/n0 (image_proc/debayer) runs in Python"
    assert chosen_for("image_proc/debayer", "only_cpp/C", compiled={}) == expected
    assert chosen_for("image_proc/rectify", "only_cpp/C")[0] == {"ours"}


def test_the_variable_overrides_the_choice() -> None:
    assert chosen_for("image_proc/debayer", PIPROS_NODELETS="genuine") == ({"genuine"}, "")
    assert chosen_for("image_proc/debayer", "only_cpp/C", PIPROS_NODELETS="ours")[0] == {"ours"}


def test_arguments_name_the_manager_in_the_namespace_of_the_loader() -> None:
    in_group = arguments_of(nodelet("n", "load a/B m --no-bond", namespace="/r/"))
    assert in_group is not None
    assert in_group.manager == "/r/m"
    absolute = arguments_of(nodelet("n", "load a/B /m", namespace="/r/"))
    assert absolute is not None
    assert absolute.manager == "/m"
    assert arguments_of(nodelet("n", "'open")) is None
    assert arguments_of(LaunchNode("a", "nodelet", "n", arguments="manager")) is None


def test_a_nodelet_that_nothing_can_load_is_explained(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    debian = make_debian(tmp_path / "debian", monkeypatch)
    load = nodelet("n", "load pcl/Nothing m")
    assert "The nodelet pcl/Nothing is a C++ plugin" in str(why_not_loadable(load, {}))
    assert "must be ours or genuine" in str(why_not_loadable(load, {"PIPROS_NODELETS": "both"}))
    assert why_not_loadable(load, {"PIPROS_NODELETS": "genuine"}) is None
    assert why_not_loadable(nodelet("m", "manager"), {}) is None
    assert why_not_loadable(nodelet("n", "standalone image_proc/debayer"), {}) is None

    package = debian.share / "my_nodelets"
    package.mkdir()
    (package / "package.xml").write_text(
        '<package><name>my_nodelets</name><export><nodelet plugin="${prefix}/all.xml"/></export></package>'
    )
    (package / "all.xml").write_text(
        '<?xml version="1.0"?>\n<library path="lib"><class name="pcl/Nothing" type="x"/></library>\n'
        '<class_libraries><library><class type="b/Unnamed"/></library></class_libraries>'
    )
    assert nodelets.compiled_nodelets() == {"pcl/Nothing": "my_nodelets", "b/Unnamed": "my_nodelets"}
    assert why_not_loadable(load, {}) is not None  # the program is not installed
    program = debian.lib / "nodelet" / "nodelet"
    program.parent.mkdir()
    program.touch(0o755)
    assert why_not_loadable(load, {}) is None
    assert "its manager is in Python" in str(why_not_loadable(load, {"PIPROS_NODELETS": "ours"}))

"""Configurations of rviz survive reading and writing."""

import pytest

from pipros.basics.errors import PiprosError
from pipros_page.scene.layout_file import RvizFileError, read_rviz, write_rviz
from tests.support.environments import file_of_tests

GENUINE = file_of_tests("golden/rviz_defaults.rviz")
FILE = """\
Panels:
  - Class: rviz/Displays
    Property Tree Widget:
      Expanded: ~
Visualization Manager:
  Class: ""
  Displays:
    - Alpha: 0.0299999993
      Class: my_plugins/Wind
      Color: 160; 160; 164
      Enabled: true
      Invented:
        - 007
        - yes
        - "#ff0000"
      Name: Wind
  Global Options:
    Fixed Frame: /map
  Views:
    Saved: ~
Window Geometry:
  QMainWindow State: 000000ff00000000fd0000000400000000
"""


def test_scalars_stay_texts() -> None:
    display = read_rviz(FILE)["Visualization Manager"]["Displays"][0]
    assert (display["Alpha"], display["Invented"]) == ("0.0299999993", ["007", "yes", "#ff0000"])
    assert display["Enabled"] == "true"


def test_a_written_file_has_the_same_content_in_the_same_order() -> None:
    config = read_rviz(FILE)
    text = write_rviz(config)
    assert read_rviz(text) == config
    assert list(read_rviz(text)["Visualization Manager"]) == list(config["Visualization Manager"])
    assert "Alpha: 0.0299999993\n" in text
    assert "Enabled: true\n" in text
    assert "Saved: ~\n" in text
    assert "- 007\n" in text


def test_a_file_of_genuine_rviz_survives_with_all_properties() -> None:
    config = read_rviz(GENUINE.read_bytes())
    shown = config["Visualization Manager"]["Displays"]
    assert len(shown) == 29
    for display in shown:
        display["Invented: Key"] = "007"
    written = read_rviz(write_rviz(config))
    assert written == config
    assert list(map(list, written["Visualization Manager"]["Displays"])) == list(map(list, shown))


@pytest.mark.parametrize(("text", "reason"), [
    ("Panels: []", "must have the key 'Visualization Manager'"),
    ("- a", "must have the key 'Visualization Manager'"), ("Visualization Manager: [", "invalid YAML"),
    ("a: " + "[" * 200 + "]" * 200, "nested"), ("&a [*a]", "invalid YAML|inside"),
])  # fmt: skip
def test_other_texts_are_refused(text: str, reason: str) -> None:
    with pytest.raises(RvizFileError, match=reason):
        read_rviz(text)


def test_old_files_are_named() -> None:
    with pytest.raises(RvizFileError, match="vcg"):
        read_rviz("Grid.Alpha: 0.5", "old.vcg")


@pytest.mark.parametrize("value", [{"Visualization Manager": {"Alpha": 1.0}}, "text", {"a": None}, {"a": {}}])
def test_only_texts_lists_and_mappings_are_written(value: object) -> None:
    with pytest.raises(PiprosError):
        write_rviz(value)

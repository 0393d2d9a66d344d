"""Definitions that lack embedded types, or are cut, are completed from installed packages."""

from __future__ import annotations

import pytest

from pipros.msg.class_finder import ClassFinder, MissingDefinition
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.language.digest import SEPARATOR
from pipros.msg.language.spec import DefinitionError

HEAD = "Header header\ngeometry_msgs/Point[] points\nown/Part part\n"
TEXTS = {
    "std_msgs/Header": "uint32 seq\ntime stamp\nstring frame_id\n",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z\n",
    "own/Part": "int8 a\n",
}


def text_of(*names: str) -> str:
    return HEAD + "".join(f"{SEPARATOR}\nMSG: {name}\n{TEXTS[name]}" for name in names)


WHOLE = message_classes_from_text("own/Whole", text_of(*TEXTS))["own/Whole"]


@pytest.mark.parametrize(
    "text",
    [
        text_of("own/Part"),
        text_of("own/Part", "geometry_msgs/Point"),
        text_of("own/Part", "std_msgs/Header", "geometry_msgs/Point")[:-11],  # a field is missing
        text_of("own/Part", "std_msgs/Header", "geometry_msgs/Point")[:-13],  # within a field
        text_of("own/Part") + f"{SEPARATOR}\nMSG: std_ms",
        text_of("own/Part") + f"{SEPARATOR}\n",
        text_of("own/Part") + SEPARATOR[:9],
        text_of("own/Part").replace("\n", "\r\n"),
    ],
)
def test_types_of_installed_packages_are_added_if_the_md5_agrees(text: str) -> None:
    found = ClassFinder().find("own/Whole", WHOLE._md5sum, text)

    assert (found._md5sum, found._slot_types) == (WHOLE._md5sum, WHOLE._slot_types)
    assert found().header.frame_id == ""


def test_types_are_not_added_if_the_md5_differs() -> None:
    with pytest.raises(DefinitionError, match="std_msgs/Header"):
        ClassFinder().find("own/Whole", "1" * 32, text_of("own/Part"))
    with pytest.raises(DefinitionError):
        ClassFinder().find("own/Whole", WHOLE._md5sum, text_of())
    with pytest.raises(MissingDefinition):
        ClassFinder().find("own/Whole", WHOLE._md5sum, "")


def test_a_complete_definition_is_used_although_its_md5_differs() -> None:
    assert ClassFinder().find("own/Whole", "1" * 32, text_of(*TEXTS))._md5sum == WHOLE._md5sum

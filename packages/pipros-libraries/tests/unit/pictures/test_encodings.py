"""One table of encodings, for conversions, exported pictures and the page."""

from __future__ import annotations

import pytest

from pipros_libraries.pictures.encodings import COLORS, Color, encoding, shown_encoding


@pytest.mark.parametrize(
    ("name", "color"),
    [("8UC1", Color.GRAY), ("8UC3", Color.BGR), ("8UC4", Color.BGRA), ("32FC1", Color.GRAY)],
)
def test_types_without_colours_are_shown_in_the_order_of_opencv(name: str, color: Color) -> None:
    assert encoding(name).color is None
    assert shown_encoding(name).color is color
    assert shown_encoding("8UC2").color is None


def test_encodings_with_colours_are_shown_in_them() -> None:
    assert {name: shown_encoding(name) for name in COLORS} == COLORS
    assert shown_encoding("yuv422_yuy2").channels == 2

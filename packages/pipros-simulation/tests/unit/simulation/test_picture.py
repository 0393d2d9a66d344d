"""The picture of turtlesim: lines, colours, PNG."""

from __future__ import annotations

import struct
import zlib

from pipros_simulation.turtlesim.picture import SIDE, Point, TurtleColor, TurtlePicture

BLUE, RED = TurtleColor(1, 2, 200), TurtleColor(200, 3, 4)


def drawn(*lines: tuple[Point, Point, int]) -> TurtlePicture:
    picture = TurtlePicture(BLUE)
    for start, end, width in lines:
        picture.draw_line(start, end, RED, width)
    return picture


def red_pixels(picture: TurtlePicture) -> set[tuple[int, int]]:
    return {(x, y) for y in range(SIDE) for x in range(SIDE) if picture.color_at((x, y)) == RED}


def test_a_new_picture_has_the_background_everywhere() -> None:
    picture = TurtlePicture(BLUE)
    assert {picture.color_at(place) for place in ((0, 0), (499, 0), (0, 499), (499, 499))} == {BLUE}


def test_a_level_line_is_as_wide_as_its_pen_and_has_square_ends() -> None:
    assert red_pixels(drawn(((10, 20), (14, 20), 3))) == {(x, y) for x in range(9, 16) for y in range(19, 22)}


def test_an_upright_line_has_the_same_shape() -> None:
    assert red_pixels(drawn(((20, 14), (20, 10), 3))) == {(x, y) for x in range(19, 22) for y in range(9, 16)}


def test_width_0_is_one_pixel_wide() -> None:
    assert red_pixels(drawn(((10, 10), (13, 10), 0))) == {(x, 10) for x in range(10, 14)}


def test_a_diagonal_line_has_no_gaps() -> None:
    picture = drawn(((10, 10), (110, 70), 3))
    for step in range(101):
        assert picture.color_at((10 + step, 10 + step * 0.6)) == RED


def test_parts_outside_are_left_out() -> None:
    picture = drawn(((-100, 250), (1e9, 250), 5), ((1e30, -1e30), (2e30, -3e30), 255))
    assert len(red_pixels(picture)) == SIDE * 5
    assert picture.color_at((-5, 250)) == TurtleColor(0, 0, 0)


def test_colors_are_those_of_the_nearest_pixel() -> None:
    picture = drawn(((10, 10), (10, 10), 1))
    assert (picture.color_at((10.4, 9.6)), picture.color_at((10.6, 10))) == (RED, BLUE)


def test_filling_removes_lines() -> None:
    picture = drawn(((10, 10), (400, 300), 9))
    picture.fill(BLUE)
    assert not red_pixels(picture)


def test_the_png_has_the_pixels() -> None:
    png = drawn(((3, 7), (3, 7), 1)).to_png()
    assert (png[:8], struct.unpack(">II", png[16:24])) == (b"\x89PNG\r\n\x1a\n", (SIDE, SIDE))
    length = struct.unpack(">I", png[33:37])[0]
    rows = zlib.decompress(png[41 : 41 + length])
    start = 7 * (1 + SIDE * 3) + 1 + 3 * 3
    assert rows[start : start + 6] == bytes((RED.r, RED.g, RED.b, BLUE.r, BLUE.g, BLUE.b))

from pathlib import Path

import pytest

from pipros_libraries.maps.errors import BadMapDescription, BadMapImage, NoMapFile
from pipros_libraries.maps.map_file import MapDescription, description_text, grid_pixels, make_grid, read_map
from pipros_libraries.pictures.planes import Picture

GOOD = """image: map.pgm
resolution: 0.1
origin: [-1.0, 2.0, 0.5]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""
PIXELS = bytes([0, 89, 90, 205, 206, 255])


def write(folder: Path, text: str = GOOD) -> str:
    (folder / "map.pgm").write_bytes(b"P5 3 2 255 " + PIXELS)
    (folder / "map.yaml").write_text(text)
    return str(folder / "map.yaml")


def cells(
    mode: str = "trinary", *colors: bytes, negate: bool = False, alpha: bytes | None = None
) -> list[int]:
    channels = colors or (PIXELS,)
    description = MapDescription("map.pgm", 0.1, mode=mode, negate=negate)
    return list(make_grid(description, Picture(len(channels[0]), 1, channels, alpha)).cells)


def test_a_map_begins_with_its_lowest_row(tmp_path: Path) -> None:
    grid = read_map(write(tmp_path))
    assert (grid.width, grid.height, grid.description.resolution) == (3, 2, 0.1)
    assert (grid.description.origin, list(grid.cells)) == ((-1.0, 2.0, 0.5), [-1, 0, 0, 100, 100, -1])


def test_each_mode_has_its_values() -> None:
    assert (cells(), cells("scale")) == ([100, 100, -1, -1, 0, 0], [100, 100, 98, 1, 0, 0])
    assert (cells("raw"), cells(negate=True)) == ([0, 89, 90, -51, -50, -1], [0, -1, -1, 100, 100, 100])


def test_colours_count_by_their_mean() -> None:
    assert cells("trinary", b"\0\xff", b"\0\xff", b"\x10\xff") == [100, 0]


def test_transparency_is_interpreted_as_in_noetic() -> None:
    assert cells("trinary", b"\x80\x60", alpha=b"\xff\0") == [-1, 100]
    assert cells("scale", b"\x80\x80\0", alpha=b"\xff\0\0") == [66, -1, 100]
    assert cells("raw", b"\x10", alpha=b"\0") == [16]


@pytest.mark.parametrize(("old", "new", "complaint"), [
    (GOOD, "- 1", r"must be a mapping with image, resolution, origin, …, got \['1'\]"),
    (GOOD, "a: [", "map.yaml:2:1: invalid YAML"),
    ("resolution: 0.1\n", "", "missing required key 'resolution'"),
    ("0.1", "0", "resolution must be > 0 m/pixel, got 0.0"),
    ("0.1", ".nan", "resolution must be a finite number, got '.nan'"),
    ("0.1", "fine", "resolution must be a finite number, got 'fine'"),
    ("[-1.0, 2.0, 0.5]", "[1, 2]", r"origin must be a list of x, y and yaw, got \['1', '2'\]"),
    ("map.pgm", "[]", "image must be the path to an image file"),
    ("negate: 0", "negate: 0\nmode: best", "mode must be one of trinary, scale, raw, got 'best'"),
])  # fmt: skip
def test_a_wrong_description_is_refused(tmp_path: Path, old: str, new: str, complaint: str) -> None:
    with pytest.raises(BadMapDescription, match=complaint):
        read_map(write(tmp_path, GOOD.replace(old, new)))


def test_files_that_are_missing_are_named(tmp_path: Path) -> None:
    with pytest.raises(NoMapFile, match=r"could not open .*nowhere\.yaml"):
        read_map(str(tmp_path / "nowhere.yaml"))
    with pytest.raises(NoMapFile, match=r"cannot read the image .*other\.pgm"):
        read_map(write(tmp_path, GOOD.replace("map.pgm", "other.pgm")))


def test_an_absolute_path_of_a_picture_is_taken_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "far").mkdir()
    write(tmp_path)
    text = GOOD.replace("map.pgm", str(tmp_path / "map.pgm"))
    assert read_map(write(tmp_path / "far", text)).description.image == str(tmp_path / "map.pgm")


def test_a_saved_map_is_read_as_it_was(tmp_path: Path) -> None:
    grid = read_map(write(tmp_path))
    pixels = grid_pixels(3, grid.cells, free=25, occupied=65)
    assert pixels == bytes([0, 0, 205, 205, 254, 254])
    (tmp_path / "again.pgm").write_bytes(b"P5 3 2 255 " + pixels)
    (tmp_path / "again.yaml").write_text(description_text("again.pgm", 0.1, (-1.0, 2.0, 0.5)))
    assert read_map(str(tmp_path / "again.yaml")).cells == grid.cells


def test_a_png_is_read_with_its_channels(tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    text = GOOD.replace("map.pgm", "map.png")
    for mode, pixels, expected in (
        ("L", [0, 205, 255], [100, -1, 0]),
        ("RGB", [(0, 0, 0), (205, 205, 205), (255, 255, 255)], [100, -1, 0]),
        ("RGBA", [(0, 0, 0, 255), (128, 128, 128, 255), (255, 255, 255, 255)], [100, -1, 0]),
        ("1", [0, 255, 255], [100, 0, 0]),
        ("I;16", [0, 205 * 256, 65535], [100, -1, 0]),
    ):
        made = image.new(mode, (3, 1))
        made.putdata(pixels)
        made.save(tmp_path / "map.png")
        assert list(read_map(write(tmp_path, text)).cells) == expected, mode
    (tmp_path / "map.png").write_bytes(b"\x89PNG\r\n\x1a\nno more")
    with pytest.raises(BadMapImage, match=r"not an image that Pillow can read: cannot identify image file$"):
        read_map(write(tmp_path, text))


def test_no_picture_runs_a_program(tmp_path: Path) -> None:
    pytest.importorskip("PIL.Image")
    write(tmp_path)  # Pillow runs Ghostscript for this one, whatever its name is
    (tmp_path / "map.pgm").write_bytes(b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n%%EndComments\n")
    with pytest.raises(BadMapImage, match="cannot identify image file"):
        read_map(str(tmp_path / "map.yaml"))

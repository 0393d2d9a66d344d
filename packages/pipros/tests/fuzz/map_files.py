"""Any YAML file of a map and any PGM image are a map with one cell per pixel, or are refused with a MapError.

The input is the text, a line `---IMAGE---`, and the image.

python -m tests.fuzz.map_files --seconds 60
"""

import sys
import tempfile
import warnings
from contextlib import suppress
from pathlib import Path

from pipros_libraries.maps.errors import MapError
from pipros_libraries.maps.map_file import description_text, grid_pixels, read_map
from tests.fuzz import mutation

BETWEEN = b"\n---IMAGE---\n"
WORDS = [
    *(
        b"image: map.pgm", b"image: /etc/passwd", b"image: [1]", b"resolution: ", b"origin: [", b"negate: ",
        b"mode: ",
    ),
    *(
        b"raw", b"scale", b"trinary", b".nan", b".inf", b"-1e400", b"occupied_thresh: ", b"free_thresh: ",
        b"&a", b"*a",
    ),
    *(
        b"P5 ", b"P2 ", b"P4 ", b"#\n", b"99999999999", b"65535", b"255\n", b"\xff", b"II*\0", b"\x89PNG\r\n",
        b"0",
    ),
    BETWEEN,
]  # fmt: skip


def target(data: bytes) -> None:
    text, _, image = data.partition(BETWEEN)
    with tempfile.TemporaryDirectory() as name:
        file = Path(name, "map.yaml")
        file.write_bytes(text)
        Path(name, "map.pgm").write_bytes(image)
        with suppress(MapError), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Pillow warns about some files
            grid = read_map(str(file))
            assert len(grid.cells) == grid.width * grid.height
            assert grid.description.mode == "raw" or all(-1 <= cell <= 100 for cell in grid.cells)
            assert len(grid_pixels(grid.width, grid.cells, 25, 65)) == len(grid.cells)
            description_text("map.pgm", grid.description.resolution, grid.description.origin)


if __name__ == "__main__":
    sys.exit(mutation.main(target, "map_files", WORDS))

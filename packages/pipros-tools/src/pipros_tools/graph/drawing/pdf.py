"""Write a drawing as a one-page PDF with lines and text.

`view_frames` uses this module to write `frames.pdf`, which tutorials and scripts expect, even if Graphviz is
not installed. The libraries reportlab and fpdf2 are not used, because they do far more than is needed here
and require Pillow. They take up 31 and 55 MB, and importing them takes 60 and 290 ms.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from pipros_tools.graph.drawing.layered_layout import Box
from pipros_tools.graph.drawing.scene import Scene
from pipros_tools.graph.drawing.svg import middle_of

_TEXT_SIZE = 12.0
_CHARACTER = 0.6
"""Width of each character in Courier, relative to the font size."""
_ROUND = 0.5523
"""Distance of a quarter ellipse's control points, in radii."""

_INK, _PALE, _LINE = "0.11 0.15 0.2", "0.36 0.4 0.45", "0.42 0.47 0.52"
_NODE = "0.91 0.95 0.99 rg 0.18 0.44 0.7 RG"
_TOPIC = "0.96 0.95 0.91 rg 0.54 0.48 0.27 RG"
_BAND = "0.96 0.96 0.97 rg 0.76 0.79 0.82 RG"


def to_pdf(scene: Scene) -> bytes:
    """Return the drawing as a PDF document. Characters outside Latin-1 become question marks."""
    page = _Page(scene.height)
    for name, box in scene.bands.items():
        page.rectangle(box, _BAND)
        left, top = box.x - box.width / 2, box.y - box.height / 2
        page.text(left + 8, top + 14, name, _PALE, is_centred=False)
    for _, route, text in scene.arrows:
        page.arrow(route)
        if text:
            x, y = middle_of(route)
            page.text(x, y - 5, text, _PALE)
    for vertex, box, text in scene.boxes:
        (page.ellipse if vertex.kind == "node" else page.rectangle)(
            box, _NODE if vertex.kind == "node" else _TOPIC
        )
        page.text(box.x, box.y + _TEXT_SIZE / 3, text, _INK)
    return _document(scene.width, scene.height, "\n".join(page.commands).encode("latin-1", "replace"))


class _Page:
    """A page's drawing commands. The y axis of a page points up, and the y axis of a scene points down."""

    def __init__(self, height: float) -> None:
        self.commands: list[str] = ["1.2 w"]
        self._height = height

    def _point(self, x: float, y: float) -> str:
        return f"{x:.2f} {self._height - y:.2f}"

    def rectangle(self, box: Box, colours: str) -> None:
        corner = self._point(box.x - box.width / 2, box.y + box.height / 2)
        self.commands.append(f"{colours} {corner} {box.width:.2f} {box.height:.2f} re B")

    def ellipse(self, box: Box, colours: str) -> None:
        a, b = box.width / 2, box.height / 2
        around = [(1, 0), (0, 1), (-1, 0), (0, -1), (1, 0)]
        parts = [colours, self._point(box.x + a, box.y), "m"]
        for (x, y), (next_x, next_y) in itertools.pairwise(around):
            parts += [
                self._point(box.x + a * (x + _ROUND * next_x), box.y + b * (y + _ROUND * next_y)),
                self._point(box.x + a * (next_x + _ROUND * x), box.y + b * (next_y + _ROUND * y)),
                self._point(box.x + a * next_x, box.y + b * next_y),
                "c",
            ]
        self.commands.append(" ".join([*parts, "B"]))

    def arrow(self, route: Sequence[tuple[float, float]]) -> None:
        parts = [f"{_LINE} RG", self._point(*route[0]), "m"]
        for (x, y), (next_x, next_y) in itertools.pairwise(route):
            middle = (x + next_x) / 2
            parts += [
                self._point(middle, y),
                self._point(middle, next_y),
                self._point(next_x, next_y),
                "c",
            ]
        self.commands.append(" ".join([*parts, "S"]))
        x, y = route[-1]
        sign = 1 if x >= route[-2][0] else -1
        head = [self._point(x, y), self._point(x - 8 * sign, y - 3.5), self._point(x - 8 * sign, y + 3.5)]
        self.commands.append(f"{_LINE} rg {head[0]} m {head[1]} l {head[2]} l f")

    def text(self, x: float, y: float, text: str, colour: str, *, is_centred: bool = True) -> None:
        left = x - len(text) * _TEXT_SIZE * _CHARACTER / 2 if is_centred else x
        escaped = text.replace("\\", r"\\").replace("(", r"\(").replace(")", r"\)")
        self.commands.append(
            f"BT {colour} rg /F1 {_TEXT_SIZE:g} Tf {self._point(left, y)} Td ({escaped}) Tj ET"
        )


def _document(width: float, height: float, commands: bytes) -> bytes:
    objects = [
        b"<< /Type /Catalog /Pages 2 0 R >>",
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        b"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 %.2f %.2f] /Contents 4 0 R "
        b"/Resources << /Font << /F1 5 0 R >> >> >>" % (width, height),
        b"<< /Length %d >>\nstream\n%s\nendstream" % (len(commands), commands),
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Courier /Encoding /WinAnsiEncoding >>",
    ]
    document = bytearray(b"%PDF-1.4\n")
    places = []
    for number, content in enumerate(objects, 1):
        places.append(len(document))
        document += b"%d 0 obj\n%s\nendobj\n" % (number, content)
    start = len(document)
    document += b"xref\n0 %d\n0000000000 65535 f \n" % (len(objects) + 1)
    document += b"".join(b"%010d 00000 n \n" % place for place in places)
    document += b"trailer\n<< /Size %d /Root 1 0 R >>\nstartxref\n%d\n%%%%EOF\n" % (len(objects) + 1, start)
    return bytes(document)

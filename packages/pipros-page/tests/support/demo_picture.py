"""The output of `script/demo` as an animated picture: each line appears when the demo printed it."""

from __future__ import annotations

import os
import re
import subprocess
import time
from pathlib import Path
from xml.sax.saxutils import escape

from pipros.basics.env import DEFAULT_MASTER_URI
from tests.support.environments import REPOSITORY
from tests.support.page_sheet import empty_system

SECONDS = 8
COLUMNS, ROWS = 96, 22
LETTER, LINE, EDGE = 7.25, 18, 14
"""Sizes (pixels) of a letter, a line and the margin."""
REST_S = 3.0
"""How long the end is shown before the picture begins again."""
_CODES = re.compile(r"\x1b\]2;.*?\x07|\x1b\[[\d;]*m")
STYLE = """
svg { font: 12px ui-monospace, "DejaVu Sans Mono", Consolas, monospace; }
rect { fill: #16202b; } text { fill: #dfe7ee; white-space: pre; }
.typed { fill: #8fe388; } .bold { font-weight: 700; }
.lines text { animation: 1s step-end infinite; }
@media (prefers-reduced-motion) { * { animation: none !important; } }
"""


def printed() -> list[tuple[float, str]]:
    """Run the demo. Return its lines, each with the time in seconds at which it was printed."""
    with empty_system() as (ros, _):
        environment = {**ros.pipros.environment, "PYTHONUNBUFFERED": "1"}
        command = [str(REPOSITORY / "script" / "demo"), f"--seconds={SECONDS}"]
        begin = time.monotonic()
        with subprocess.Popen(
            command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        ) as demo:
            assert demo.stdout is not None
            lines = [(time.monotonic() - begin, line.rstrip("\n")) for line in demo.stdout]
        names = {
            f"export ROS_MASTER_URI={ros.master_uri} && ": "",
            ros.master_uri: DEFAULT_MASTER_URI,
            str(REPOSITORY): "~/pipros",
            str(ros.home): "~",
            os.uname().nodename: "robot",
        }
    for name, shown in names.items():
        lines = [(when, line.replace(name, shown)) for when, line in lines]
    return lines


def draw(lines: list[tuple[float, str]]) -> str:
    """Return the picture (SVG). Programs that show no animations show the last lines."""
    rows = [(0.0, "typed", "$ script/demo")]
    for when, line in lines:
        kind = "bold" if "\x1b[1m" in line else ""
        text = _CODES.sub("", line)
        rows += [(when, kind, text[at : at + COLUMNS]) for at in range(0, max(len(text), 1), COLUMNS)]
    whole = rows[-1][0] + REST_S
    width, height = COLUMNS * LETTER + 2 * EDGE, ROWS * LINE + 2 * EDGE
    shift = max(0, len(rows) - ROWS) * LINE
    styles = [STYLE, f".lines, .lines text {{ animation-duration: {whole:.1f}s; }}"]
    moves = ["0% { transform: none; }"]
    texts = []
    for number, (when, kind, text) in enumerate(rows):
        percent = f"{100 * when / whole:.2f}%"
        if number >= ROWS:
            moves.append(f"{percent} {{ transform: translateY(-{(number - ROWS + 1) * LINE}px); }}")
        name = f"a{number}"
        styles.append(f"@keyframes {name} {{ 0% {{ opacity: 0; }} {percent}, 100% {{ opacity: 1; }} }}")
        y = EDGE + (number + 0.75) * LINE
        texts.append(
            f'<text class="{kind}" style="animation-name:{name}" x="{EDGE}" y="{y}">{escape(text)}</text>'
        )
    styles.append(f"@keyframes scroll {{ {' '.join(moves)} }}")
    styles.append(
        f".lines {{ animation: scroll {whole:.1f}s step-end infinite; transform: translateY(-{shift}px); }}"
    )
    return "\n".join(
        (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height}">',
            "<title>The terminal while script/demo runs</title>",
            f"<style>{''.join(styles)}</style>",
            f'<clipPath id="screen"><rect y="{EDGE}" width="{width:.0f}" height="{ROWS * LINE}"/></clipPath>',
            f'<rect width="{width:.0f}" height="{height}" rx="8"/>',
            '<g clip-path="url(#screen)"><g class="lines">',
            *texts,
            "</g></g>",
            "</svg>\n",
        )
    )


def take_demo(file: Path) -> None:
    """Write the picture of a run."""
    file.write_text(draw(printed()), encoding="utf-8")

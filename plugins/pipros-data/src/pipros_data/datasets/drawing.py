"""Draw an episode as SVG: its signals over time, with the findings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from pipros_data.datasets.checks import DatasetFinding

_WIDTH, _HEIGHT, _LEFT, _GAP = 900, 90, 170, 34
_POINTS = 900
_COLOURS = ("#2f6fb3", "#c0662b", "#3f8f4f", "#8a4fa8", "#b33a4d", "#6b7785")


def episode_svg(
    title: str,
    seconds: NDArray[np.float64],
    signals: Mapping[str, NDArray[np.float64]],
    findings: Sequence[DatasetFinding],
) -> str:
    """Return a drawing with a plot for each signal, in which the spans of findings are red.

    `seconds` contains the times of the rows since the start of the episode. Each array in `signals` has one
    row per time.
    """
    longest = max(
        [float(seconds[-1]) if len(seconds) else 0.0, *(e for f in findings for _, e in f.spans), 1e-9]
    )
    scale = (_WIDTH - _LEFT - 10) / longest
    names = [*signals, *sorted({each.source for each in findings} - set(signals))]
    height = len(names) * (_HEIGHT + _GAP) + 60
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height}" width="{_WIDTH}" '
        f'height="{height}" font-family="sans-serif" font-size="12">',
        f'<rect width="{_WIDTH}" height="{height}" fill="#fff"/>',
        f'<text x="10" y="20" font-size="14">{escape(title)}</text>',
    ]
    for number, name in enumerate(names):
        top = 36 + number * (_HEIGHT + _GAP)
        own = [each for each in findings if each.source == name]
        parts.append(
            f'<rect x="{_LEFT}" y="{top}" width="{_WIDTH - _LEFT - 10}" height="{_HEIGHT}" fill="#f3f5f8"/>'
        )
        parts.append(f'<text x="10" y="{top + 16}">{escape(name[:26])}</text>')
        for finding in own:
            for begin, end in finding.spans:
                x, width = _LEFT + max(begin, 0) * scale, max((end - max(begin, 0)) * scale, 2)
                box = f'x="{x:.1f}" y="{top}" width="{width:.1f}" height="{_HEIGHT}"'
                hint = escape(f"{finding.check}: {finding.text}")
                parts.append(f'<rect {box} fill="#c0392b" fill-opacity=".25"><title>{hint}</title></rect>')
        if name in signals:
            parts += _lines(seconds, signals[name], top, scale)
        text = ", ".join(f"{each.check}: {each.text}" for each in own)[:130]
        parts.append(f'<text x="{_LEFT}" y="{top + _HEIGHT + 15}" fill="#a0281c">{escape(text)}</text>')
    parts.append(f'<text x="{_WIDTH - 10}" y="{height - 8}" text-anchor="end">{longest:.1f} s</text>')
    return "\n".join([*parts, "</svg>"]) + "\n"


def _lines(seconds: NDArray[np.float64], values: NDArray[np.float64], top: int, scale: float) -> list[str]:
    finite = values[np.isfinite(values)]
    if not finite.size:
        return []
    low, high = float(finite.min()), float(finite.max())
    step = -(-len(seconds) // _POINTS)
    found = [f'<text x="{_LEFT - 6}" y="{top + y}" text-anchor="end" fill="#6b7785">{v:.4g}</text>'
             for y, v in ((11, high), (_HEIGHT, low))]  # fmt: skip
    for column in range(values.shape[1]):
        points, pen = [], "M"
        for x, y in zip(seconds[::step].tolist(), values[::step, column].tolist(), strict=True):
            if not np.isfinite(y):
                pen = "M"
                continue
            share = (y - low) / (high - low) if high > low else 0.5
            points.append(f"{pen}{_LEFT + x * scale:.1f},{top + 4 + (1 - share) * (_HEIGHT - 8):.1f}")
            pen = "L"
        colour = _COLOURS[column % len(_COLOURS)]
        found.append(f'<path d="{"".join(points)}" fill="none" stroke="{colour}" stroke-width="1.2"/>')
    return found

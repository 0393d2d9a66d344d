"""Compare the results of a script in genuine ROS's Python and in that of pipros."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from typing import Any


def both_results(script: str, *arguments: object) -> tuple[list[Any], list[Any]]:
    """Return the results of genuine ROS and of pipros: the JSON lists that the script prints."""
    genuine, ours = (
        json.loads(
            subprocess.run(
                [python, script, *map(str, arguments)],
                env={"PATH": "/usr/bin:/bin"},
                check=True,
                capture_output=True,
                text=True,
            ).stdout
        )
        for python in ("/usr/bin/python3", sys.executable)
    )
    assert len(genuine) == len(ours)
    return genuine, ours


def different_pairs(genuine: list[Any], ours: list[Any]) -> list[tuple[Any, Any]]:
    return [(one, other) for one, other in zip(genuine, ours, strict=True) if not is_near(one, other)]


def is_near(one: Any, other: Any) -> bool:
    """Return whether values are equal, except for the rounding of numbers."""
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(is_near, one, other))
    if isinstance(one, float) and isinstance(other, float):
        return (math.isnan(one) and math.isnan(other)) or math.isclose(one, other, rel_tol=1e-9, abs_tol=1e-9)
    return type(one) is type(other) and bool(one == other)

"""Compare the results of a script in genuine ROS's Python and in that of pipros."""

import json
import math
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def printed(*argv: str | Path, environment: Mapping[str, str] | None = None, given: str | None = None) -> str:
    """Return the output of a program, which must succeed; by default, in an environment without ROS."""
    bare = {"PATH": "/usr/bin:/bin"}
    ended = subprocess.run(argv, env=environment or bare, input=given, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


def both_results(script: str, *arguments: object) -> tuple[list[Any], list[Any]]:
    """Return the results of genuine ROS and of pipros: the JSON lists that the script prints."""
    genuine, ours = (
        json.loads(printed(python, script, *map(str, arguments)))
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

"""Images and cameras: the libraries of both sides answer alike on random arguments."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

from tests.support.environments import REPOSITORY

PROGRAMS = Path(__file__).parent / "programs"
GENUINE = "/usr/bin/python3"


def asked(python: str, program: str, seed: int, **environment: str) -> Any:
    ended = subprocess.run(
        [python, PROGRAMS / f"{program}.py", str(seed)],
        env={"PATH": "/usr/bin:/bin", **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    return json.loads(ended.stdout)


def is_near(one: Any, other: Any) -> bool:
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(is_near, one, other))
    if isinstance(one, float) and isinstance(other, float):
        return (math.isnan(one) and math.isnan(other)) or math.isclose(one, other, rel_tol=1e-9, abs_tol=1e-9)
    return type(one) is type(other) and bool(one == other)


def differing(genuine: dict[str, Any], ours: dict[str, Any]) -> dict[str, tuple[Any, Any]]:
    assert genuine.keys() == ours.keys()
    return {name: (genuine[name], ours[name]) for name in genuine if not is_near(genuine[name], ours[name])}


def test_cv_bridge_makes_the_same_images() -> None:
    genuine = asked(GENUINE, "examine_cv_bridge", 2)

    assert len(genuine) > 5000
    assert differing(genuine, asked(sys.executable, "examine_cv_bridge", 2)) == {}


def test_compressed_images_are_the_same_bytes() -> None:
    ours = asked(GENUINE, "examine_compressed_images", 1, PYTHONPATH=str(REPOSITORY / "src"))

    assert differing(asked(GENUINE, "examine_compressed_images", 1), ours) == {}

"""tf.transformations of both sides has the same results, function by function, for random arguments."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from typing import Any

import pytest

from tests.interop.programs.examine_transformations import __file__ as script

COUNT = 40


def asked(python: str, seed: int) -> list[Any]:
    ended = subprocess.run(
        [python, script, str(seed), str(COUNT)],
        env={"PATH": "/usr/bin:/bin"},
        check=True,
        capture_output=True,
        text=True,
    )
    return list(json.loads(ended.stdout))


def is_near(one: Any, other: Any) -> bool:
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(is_near, one, other))
    if isinstance(one, float) and isinstance(other, float):
        return (math.isnan(one) and math.isnan(other)) or math.isclose(one, other, rel_tol=1e-9, abs_tol=1e-9)
    return type(one) is type(other) and bool(one == other)


@pytest.mark.parametrize("seed", [1, 2])
def test_every_function_has_the_same_results(seed: int) -> None:
    genuine, ours = asked("/usr/bin/python3", seed), asked(sys.executable, seed)

    assert len(genuine) == len(ours)
    differing = [(one, other) for one, other in zip(genuine, ours, strict=True) if not is_near(one, other)]
    # Because eigenvalues lose digits, each side sometimes refuses a shear matrix.
    refused = ["shear_from_matrix", "raises ValueError"]
    assert [pair for pair in differing if refused not in pair] == []

"""Time and Duration of pipros and of genuine genpy, on the same expressions."""

from __future__ import annotations

import json
import subprocess

import genpy
from tests.interop.programs.examine_time import __file__ as script
from tests.interop.programs.examine_time import expressions, outcome


def test_every_expression_has_the_same_outcome() -> None:
    asked = expressions(seed=1, count=2000)
    genuine = subprocess.run(
        ["/usr/bin/python3", script],
        input=json.dumps(asked),
        env={"PATH": "/usr/bin:/bin"},
        check=True,
        capture_output=True,
        text=True,
    )

    expected = dict(zip(asked, json.loads(genuine.stdout), strict=True))

    assert {expression: outcome(expression, genpy) for expression in asked} == expected

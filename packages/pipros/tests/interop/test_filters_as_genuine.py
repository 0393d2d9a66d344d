"""message_filters of both sides form the same sets from the same sequences, in the same order."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

import pytest

from tests.interop.programs.examine_filters import __file__ as script


def asked(python: str, seed: int) -> Any:
    ended = subprocess.run(
        [python, script, str(seed), "300"],
        env={"PATH": "/usr/bin:/bin"},
        check=True,
        capture_output=True,
        text=True,
    )
    return json.loads(ended.stdout)


@pytest.mark.parametrize("seed", [1, 2])
def test_random_sequences_have_the_same_results(seed: int) -> None:
    assert asked(sys.executable, seed) == asked("/usr/bin/python3", seed)

from __future__ import annotations

import pytest

from pipros_tools.launch.model import LaunchError
from pipros_tools.launch.run_options import RunOptions


@pytest.mark.parametrize("name", ["sigint_timeout_s", "sigterm_timeout_s"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan")])
def test_timeouts_are_positive(name: str, value: float) -> None:
    with pytest.raises(LaunchError, match="must be a positive number, received"):
        RunOptions(**{name: value})  # type: ignore[arg-type]

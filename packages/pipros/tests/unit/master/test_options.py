from __future__ import annotations

from dataclasses import fields

import pytest

from pipros.basics.limits import process_limits
from pipros.master.options import MasterOptions, MasterSettings, limits_with_timeout


def test_each_option_is_a_keyword_argument_of_master_and_core() -> None:
    hints = MasterSettings.__annotations__
    assert [(field.name, field.type) for field in fields(MasterOptions)] == [
        (name, hint.__forward_arg__) for name, hint in hints.items()
    ]


@pytest.mark.parametrize("timeout_s", [None, 0.0, -1.0, float("nan")])
def test_a_timeout_that_is_not_positive_leaves_the_default(timeout_s: float | None) -> None:
    assert limits_with_timeout(timeout_s) == process_limits()


def test_the_timeout_option_is_the_timeout_of_notifications() -> None:
    assert limits_with_timeout(2.5).notice_s == 2.5

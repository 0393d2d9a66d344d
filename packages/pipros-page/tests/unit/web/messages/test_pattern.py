"""Messages with expressions of time and count."""

from __future__ import annotations

import pytest

from pipros.safe.expr_walk import ExpressionError
from pipros_page.messages.pattern import MessagePattern


def test_texts_that_begin_with_an_equals_sign_are_evaluated() -> None:
    pattern = MessagePattern({"x": "=2 * i", "all": ["=t", {"name": "=f'step {i}'"}], "is_on": "=i % 2 == 1"})
    assert pattern.value(3, 1.5) == {"x": 6, "all": [1.5, {"name": "step 3"}], "is_on": True}


@pytest.mark.parametrize("value", ["== title ==", "a = b", "", 7, None, [1, 2]])
def test_other_values_stay(value: object) -> None:
    assert MessagePattern({"x": value}).value(0, 0.0) == {"x": value}


def test_errors_name_the_expression() -> None:
    with pytest.raises(ExpressionError, match=r"\[1 \+\]"):
        MessagePattern({"x": "=1 +"})
    with pytest.raises(ExpressionError, match="nothing"):
        MessagePattern({"x": "=nothing"}).value(0, 0.0)


def test_expressions_cannot_reach_the_interpreter() -> None:
    with pytest.raises(ExpressionError):
        MessagePattern({"x": "=().__class__"}).value(0, 0.0)

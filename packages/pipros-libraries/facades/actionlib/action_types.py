"""The message classes of an action."""

from __future__ import annotations

from typing import Any

from actionlib.exceptions import ActionException


class ActionTypes:
    """The message classes that belong to an action class such as `TestAction`.

    Raises:
        ActionException: `ActionSpec` is not the class of an action.
    """

    def __init__(self, ActionSpec: Any) -> None:
        try:
            action = ActionSpec()
            self.goal: Any = type(action.action_goal)
            self.result: Any = type(action.action_result)
            self.result_content: Any = type(action.action_result.result)
            self.feedback: Any = type(action.action_feedback)
        except (AttributeError, TypeError):
            raise ActionException(
                f"Type is not an action spec: {ActionSpec}. It must be a class whose name ends in Action"
            ) from None

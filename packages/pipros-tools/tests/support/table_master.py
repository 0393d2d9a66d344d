"""A master client that takes its responses from a table, for tests without sockets."""

from collections.abc import Callable, Collection, Mapping
from typing import Any

from pipros.basics.errors import Refused
from pipros.net.master_client import MasterClient

Answers = Mapping[tuple[Any, ...], Any]


class TableMaster(MasterClient):
    """Responds to each call from a table: `{("lookupNode", "/a"): "http://…"}`. Other calls are refused.

    Attributes:
        answers: the table, which tests may change.
        calls: the method and parameters of each call so far.
    """

    def __init__(self, answers: Answers, accepts: Collection[str] = ()) -> None:
        """`accepts` names methods that succeed with any parameters, and return 1."""
        super().__init__("http://127.0.0.1:1/", "/test")
        self.answers = dict(answers)
        self._accepts = accepts
        self.calls: list[tuple[Any, ...]] = []

    def call(
        self,
        method: str,
        *params: Any,
        timeout_s: float | None = None,
        meanwhile: Callable[[], None] | None = None,
    ) -> Any:
        call = (method, *params)
        self.calls.append(call)
        if method in self._accepts:
            return 1
        if call not in self.answers:
            raise Refused("the table", -1, f"no answer to {method}{params}")
        return self.answers[call]

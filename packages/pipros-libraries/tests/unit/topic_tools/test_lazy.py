from __future__ import annotations

from typing import Any

from pipros_libraries.topic_tools.lazy import LazyInputs


class Output:
    """A publisher with any number of subscribers, which notifies its listeners."""

    def __init__(self) -> None:
        self.connection_count = 0
        self.listeners: list[Any] = []
        self.publication = self

    def change(self, by: int) -> None:
        self.connection_count += by
        for each in self.listeners:
            if by > 0:
                each.peer_subscribe("/out", None, None)
            else:
                each.peer_unsubscribe("/out", self.connection_count)


class Input:
    is_registered = True

    def unregister(self) -> None:
        self.is_registered = False


def test_inputs_are_subscribed_to_while_an_output_has_subscribers() -> None:
    outputs, made = [Output(), Output()], []

    def subscribe() -> list[Input]:
        made.append(Input())
        return made[-1:]

    lazy = LazyInputs(outputs, subscribe)
    assert not made
    outputs[0].change(1)
    outputs[1].change(1)
    outputs[0].change(-1)
    assert [each.is_registered for each in made] == [True]
    outputs[1].change(-1)
    assert [each.is_registered for each in made] == [False]
    outputs[1].change(1)
    assert [each.is_registered for each in made] == [False, True]
    lazy.close()
    outputs[0].change(1)
    assert [each.is_registered for each in made] == [False, False]
    assert outputs[0].listeners == []


def test_subscribers_that_came_before_count() -> None:
    output, made = Output(), [Input()]
    output.connection_count = 1
    lazy = LazyInputs([output], lambda: made)
    lazy.close()
    assert not made[0].is_registered

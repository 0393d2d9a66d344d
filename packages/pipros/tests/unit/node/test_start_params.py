"""Start options of a node, read from its parameters."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from pipros.node.start_params import is_on, set_private_params, window_limits
from pipros.node.topic_statistics import WindowLimits
from pipros.safe.yaml import YamlError


class Params(dict[str, Any]):
    def get(self, key: str, *_: Any) -> Any:
        return self[key]

    def set(self, key: str, value: Any) -> None:
        self[key] = value


def node(values: dict[str, Any], **private: str) -> Any:
    identity = SimpleNamespace(arguments=SimpleNamespace(params=private))
    return SimpleNamespace(params=Params(values), identity=identity)


@pytest.mark.parametrize(("value", "expected"), [(True, True), (False, False), (1, False), ("true", False)])
def test_a_switch_is_on_only_when_it_is_true(value: object, expected: bool) -> None:
    assert is_on(node({"/use_sim_time": value}), "/use_sim_time") is expected


def test_a_switch_that_is_not_set_is_off() -> None:
    assert not is_on(node({}), "/use_sim_time")


def test_private_parameters_are_read_as_yaml() -> None:
    started = node({}, rate="10", names="[a, b]")

    set_private_params(started)

    assert started.params == {"~rate": 10, "~names": ["a", "b"]}


def test_a_private_parameter_that_is_not_yaml_is_refused() -> None:
    with pytest.raises(YamlError):
        set_private_params(node({}, rate="[1"))


def test_windows_have_defaults_for_missing_and_invalid_parameters() -> None:
    given = {"/statistics_window_max_size": 8, "/statistics_window_min_size": -1}
    given |= {"/statistics_window_min_elements": "many"}  # type: ignore[dict-item]

    assert window_limits(node(given)) == WindowLimits(max_size_s=8)

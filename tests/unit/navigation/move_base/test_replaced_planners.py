"""Limits of planners in C++ become limits of DWA."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import pytest

from pipros.basics.errors import NotFound
from pipros.navigation.move_base.replaced_planners import take_over


class Params:
    """The parameters of a node, one dictionary for each namespace."""

    def __init__(self, values: Mapping[str, Mapping[str, Any]]) -> None:
        self.values = {name: dict(each) for name, each in values.items()}

    def get(self, name: str) -> Any:
        if name not in self.values:
            raise NotFound(name)
        return self.values[name]

    def set(self, name: str, value: Any) -> None:
        namespace, _, last = name.rpartition("/")
        self.values.setdefault(namespace, {})[last] = value


def dwa_after(planner: str, given: dict[str, Any], own: dict[str, Any]) -> tuple[dict[str, Any], list[str]]:
    params = Params({f"~{planner}": given, "~DWAPlannerROS": own})
    node: Any = SimpleNamespace(params=params)
    _, left = take_over(node, f"package/{planner}")
    return params.values["~DWAPlannerROS"], left


def test_limits_of_teb_bound_every_default_of_dwa() -> None:
    given = {"max_vel_x": 0.2, "max_vel_x_backwards": 0.05, "max_vel_theta": 0.3, "dt_ref": 0.3}
    found, left = dwa_after("TebLocalPlannerROS", given, {})
    assert found == {
        "max_vel_x": 0.2, "min_vel_x": -0.05, "max_vel_theta": 0.3, "max_vel_trans": 0.2, "max_vel_y": 0.0,
        "min_vel_y": 0.0, "min_vel_trans": 0.05, "min_vel_theta": 0.15,
    }  # fmt: skip
    assert left == ["dt_ref"]


@pytest.mark.parametrize(
    ("planner", "given", "name", "value"),
    [
        ("DWBLocalPlanner", {"max_speed_xy": 0.3}, "max_vel_x", 0.3),
        ("DWBLocalPlanner", {"vtheta_samples": 9}, "vth_samples", 9),
        ("EBandPlannerROS", {"max_vel_lin": 0.4, "max_vel_th": 0.7}, "max_vel_theta", 0.7),
        ("EBandPlannerROS", {"max_vel_lin": 0.4}, "max_vel_trans", 0.4),
    ],
)
def test_limits_have_other_names_in_other_planners(
    planner: str, given: dict[str, Any], name: str, value: float
) -> None:
    assert dwa_after(planner, given, {})[0][name] == value


def test_parameters_of_dwa_itself_come_first() -> None:
    found, left = dwa_after("TebLocalPlannerROS", {"max_vel_x": 0.2}, {"max_vel_x": 0.1})
    assert found == {"max_vel_x": 0.1}
    assert left == ["max_vel_x"]

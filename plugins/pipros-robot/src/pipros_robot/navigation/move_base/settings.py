"""The parameters of move_base that clients can change, in the same order as in genuine move_base."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from pipros_libraries.reconfiguring.declared import settings_of, tunable


@dataclass(frozen=True, slots=True)
class MoveBaseSettings:
    """The parameters by their ROS names. Lengths are in metres, times in seconds, frequencies in Hz."""

    base_global_planner: str = tunable("navfn/NavfnROS", "The global planner")
    base_local_planner: str = tunable("base_local_planner/TrajectoryPlannerROS", "The local planner")
    planner_frequency: float = tunable(0.0, "Plans per second; 0: only when one is needed", 0, 100)
    controller_frequency: float = tunable(20.0, "Commands per second", 0, 100)
    planner_patience: float = tunable(5.0, "Seconds without a plan before the recovery", 0, 100)
    controller_patience: float = tunable(5.0, "Seconds without a legal command before the recovery", 0, 100)
    max_planning_retries: int = tunable(-1, "Failed plans before the recovery; below 0: no limit", -1, 1000)
    conservative_reset_dist: float = tunable(3.0, "Side of the square that the first reset keeps, m", 0, 50)
    recovery_behavior_enabled: bool = tunable(True, "Whether recovery behaviours run")
    clearing_rotation_allowed: bool = tunable(True, "Whether the default recovery turns the robot")
    shutdown_costmaps: bool = tunable(False, "Whether to stop the costmaps between goals")
    oscillation_timeout: float = tunable(0.0, "Seconds without progress before recovery; 0: no limit", 0, 60)
    oscillation_distance: float = tunable(0.5, "Distance that counts as progress, m", 0, 10)
    make_plan_clear_costmap: bool = tunable(True, "Whether make_plan frees the robot's surroundings")
    make_plan_add_unreachable_goal: bool = tunable(True, "Whether make_plan appends the goal itself")
    restore_defaults: bool = tunable(False, "Return to the settings at startup")


SETTINGS: Final = settings_of(MoveBaseSettings)
INITIAL_PATIENCE: Final = 15.0
"""`controller_patience` until a client first changes a setting, if the parameter is not set."""

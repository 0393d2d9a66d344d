"""The reconfigurable parameters of move_base, in the order of genuine's description."""

from __future__ import annotations

from typing import Final

from pipros.libraries.reconfiguring.server import Setting

SETTINGS: Final = (
    Setting("base_global_planner", "navfn/NavfnROS", description="The global planner"),
    Setting("base_local_planner", "base_local_planner/TrajectoryPlannerROS", description="The local planner"),
    Setting(
        "planner_frequency", 0.0, 0, 100, "Plans per second; 0: only for a new goal, or without a command"
    ),
    Setting("controller_frequency", 20.0, 0, 100, "Commands per second"),
    Setting("planner_patience", 5.0, 0, 100, "Seconds without a plan before the recovery"),
    Setting("controller_patience", 5.0, 0, 100, "Seconds without a legal command before the recovery"),
    Setting("max_planning_retries", -1, -1, 1000, "Failures to plan before the recovery; negative: no limit"),
    Setting("conservative_reset_dist", 3.0, 0, 50, "Side of the square that the first recovery keeps, m"),
    Setting("recovery_behavior_enabled", True, description="Whether there is a recovery"),
    Setting("clearing_rotation_allowed", True, description="Whether the default recovery turns the robot"),
    Setting("shutdown_costmaps", False, description="Whether the costmaps rest between goals"),
    Setting("oscillation_timeout", 0.0, 0, 60, "Seconds without progress before the recovery; 0: no limit"),
    Setting("oscillation_distance", 0.5, 0, 10, "Distance that counts as progress, m"),
    Setting("make_plan_clear_costmap", True, description="Whether make_plan frees the robot's surroundings"),
    Setting("make_plan_add_unreachable_goal", True, description="Whether make_plan appends the goal itself"),
    Setting("restore_defaults", False, description="Return to the settings of the start"),
)
INITIAL_PATIENCE: Final = 15.0
"""`controller_patience` until a client first changes a setting, if the parameter is not set."""

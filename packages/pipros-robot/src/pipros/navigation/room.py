"""The declaration of the room `navigation`; see `pipros.basics.rooms`."""

from pipros.basics.rooms import Room

_MODULES = "pipros.navigation.velocities"

ROOM = Room(
    "navigation",
    "navigation for mobile robots",
    needs=("perception", "simulation"),
    limits="pipros.navigation.limits:NavigationLimits",
    offers={"pytest": "pipros.navigation.pytest_world"},
    share=(
        "amcl",
        "costmap_2d",
        "dwa_local_planner",
        "explore_lite",
        "geographic_msgs",
        "gmapping",
        "hector_mapping",
        "kobuki_safety_controller",
        "laser_scan_matcher",
        "move_base",
        "navfn",
        "robot_localization",
        "robot_pose_ekf",
        "uuid_msgs",
        "yocs_cmd_vel_mux",
        "yocs_velocity_smoother",
    ),
    nodelets={
        "kobuki_safety_controller/SafetyControllerNodelet": f"{_MODULES}.safety_controller_node:SafetyNode",
        "yocs_cmd_vel_mux/CmdVelMuxNodelet": f"{_MODULES}.cmd_vel_mux_node:CmdVelMuxNode",
        "yocs_velocity_smoother/VelocitySmootherNodelet": f"{_MODULES}.velocity_smoother_node:SmootherNode",
    },
    extras={"navigation": ("pipros[vision]",)},
)

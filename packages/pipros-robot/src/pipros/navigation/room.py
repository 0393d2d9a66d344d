"""The declaration of the room `navigation`; see `pipros.basics.rooms`."""

from pipros.basics.rooms import Room

ROOM = Room(
    "navigation",
    "navigation for mobile robots",
    needs=("simulation",),
    limits="pipros.navigation.limits:NavigationLimits",
    offers={"pytest": "pipros.navigation.pytest_world"},
    share=(
        "amcl",
        "costmap_2d",
        "dwa_local_planner",
        "geographic_msgs",
        "gmapping",
        "move_base",
        "navfn",
        "robot_localization",
        "robot_pose_ekf",
        "uuid_msgs",
    ),
    extras={"navigation": ("pipros[vision]",)},
)

"""The declaration of navigation; see `pipros.basics.rooms`."""

from pipros.basics.rooms import Room

ROOM = Room(
    "navigation",
    "navigation for mobile robots",
    limits="pipros.navigation.limits:NavigationLimits",
    share=("amcl", "costmap_2d", "gmapping", "navfn", "robot_localization"),
    extras={"navigation": ("pipros[vision]",)},
)

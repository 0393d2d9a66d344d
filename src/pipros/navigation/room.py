"""The declaration of navigation; see `pipros.basics.rooms`."""

from pipros.basics.rooms import Room

ROOM = Room(
    "navigation",
    "navigation for mobile robots",
    share=("amcl", "robot_localization"),
    extras={"navigation": ("pipros[vision]",)},
)

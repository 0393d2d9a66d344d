"""The declaration of turtlesim and the simulated robots; see `pipros.basics.rooms`."""

from pipros.basics.rooms import Room, RoomCommand

ROOM = Room(
    "simulation",
    "turtlesim, and robots in a flat world",
    subcommands={
        "sim-for": RoomCommand(
            "pipros.simulation.commands.sim_for:main",
            "print a launch file that runs another one on a simulated robot",
            "Run",
        ),
    },
    limits="pipros.simulation.limits:SimulationLimits",
    offers={
        "instead": "pipros.simulation.instead:INSTEAD",
        "practice": "pipros.simulation.practice:simulated_robot",
    },
    share=(
        "controller_manager",
        "controller_manager_msgs",
        "fake_localization",
        "pipros_sim",
        "stage_ros",
        "turtle_actionlib",
        "turtle_teleop",
        "turtle_tf",
        "turtle_tf2",
        "turtlebot3_fake",
        "turtlesim",
    ),
)

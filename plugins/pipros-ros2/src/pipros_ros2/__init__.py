"""Gateway between ROS 1 and ROS 2, support for ROS 2 bags, and message conversion."""

__all__ = ["to_ros1", "to_ros2"]

TYPE_CHECKING = False
if TYPE_CHECKING:
    from pipros_ros2.objects import to_ros1, to_ros2


def __getattr__(name: str) -> object:
    # The declaration of the room imports this package, which must therefore import nothing else.
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from pipros_ros2 import objects

    return getattr(objects, name)

"""Messages of tf, made from their definitions by `pipros stubs`."""

from pipros.msg import base as _base
import geometry_msgs.msg

class tfMessage(_base.Message):
    """Transforms in the type of the older tf. It is the same on the wire as tf2_msgs/TFMessage, which new code
    uses."""
    transforms: list[geometry_msgs.msg.TransformStamped]
    """any number"""
    def __init__(self, transforms: list[geometry_msgs.msg.TransformStamped] | None = ...) -> None: ...

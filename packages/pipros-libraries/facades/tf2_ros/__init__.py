"""Drop-in replacement for Noetic's tf2_ros: transform buffers with topics, services and actions."""

import typing as _typing

from pipros.basics.lazy_names import lazy_names as _lazy_names
from pipros.basics.lazy_names import star_names as _star_names
from tf2_py import BufferCore as BufferCore
from tf2_py import ConnectivityException as ConnectivityException
from tf2_py import ExtrapolationException as ExtrapolationException
from tf2_py import InvalidArgumentException as InvalidArgumentException
from tf2_py import LookupException as LookupException
from tf2_py import TimeoutException as TimeoutException
from tf2_py import TransformException as TransformException
from tf2_ros.buffer import DEFAULT_CAN_TRANSFORM_POLLING_SCALE as DEFAULT_CAN_TRANSFORM_POLLING_SCALE
from tf2_ros.buffer import Buffer as Buffer
from tf2_ros.buffer_interface import BufferInterface as BufferInterface
from tf2_ros.buffer_interface import ConvertRegistration as ConvertRegistration
from tf2_ros.buffer_interface import NotImplementedException as NotImplementedException
from tf2_ros.buffer_interface import Stamped as Stamped
from tf2_ros.buffer_interface import TransformRegistration as TransformRegistration
from tf2_ros.buffer_interface import TypeException as TypeException
from tf2_ros.buffer_interface import convert as convert
from tf2_ros.static_transform_broadcaster import StaticTransformBroadcaster as StaticTransformBroadcaster
from tf2_ros.transform_broadcaster import TransformBroadcaster as TransformBroadcaster
from tf2_ros.transform_listener import TransformListener as TransformListener

# Imported on first use: most programs need neither actionlib nor these message classes.
if _typing.TYPE_CHECKING:
    from actionlib_msgs.msg import GoalStatus as GoalStatus
    from geometry_msgs.msg import TransformStamped as TransformStamped
    from std_msgs.msg import Header as Header
    from tf2_msgs.msg import LookupTransformAction as LookupTransformAction
    from tf2_msgs.msg import LookupTransformGoal as LookupTransformGoal
    from tf2_msgs.msg import TFMessage as TFMessage
    from tf2_msgs.srv import FrameGraph as FrameGraph
    from tf2_msgs.srv import FrameGraphResponse as FrameGraphResponse

    from tf2_ros.buffer_client import BufferClient as BufferClient
    from tf2_ros.buffer_server import BufferServer as BufferServer
else:
    __getattr__, __dir__ = _lazy_names(
        __name__,
        {
            "BufferClient": "tf2_ros.buffer_client",
            "BufferServer": "tf2_ros.buffer_server",
            "FrameGraph": "tf2_msgs.srv",
            "FrameGraphResponse": "tf2_msgs.srv",
            "GoalStatus": "actionlib_msgs.msg",
            "Header": "std_msgs.msg",
            "LookupTransformAction": "tf2_msgs.msg",
            "LookupTransformGoal": "tf2_msgs.msg",
            "TFMessage": "tf2_msgs.msg",
            "TransformStamped": "geometry_msgs.msg",
        },
    )

_star_names(
    __name__,
    "actionlib tf2_ros.buffer_client:BufferClient copy:deepcopy tf2_msgs.srv:FrameGraph "
    "tf2_msgs.srv:FrameGraphResponse actionlib_msgs.msg:GoalStatus std_msgs.msg:Header "
    "tf2_msgs.msg:LookupTransformAction tf2_msgs.msg:LookupTransformGoal rosgraph rospy tf2=tf2_py tf2_ros "
    "tf2_ros.buffer_client tf2_msgs.msg:TFMessage threading geometry_msgs.msg:TransformStamped",
    hidden="BufferServer buffer_server",
)

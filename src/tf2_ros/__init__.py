"""tf2_ros, as Noetic has it, on pipros: buffers of transforms with topics, services and actions."""

from typing import Any as _Any

from tf2_py import BufferCore as BufferCore
from tf2_py import ConnectivityException as ConnectivityException
from tf2_py import ExtrapolationException as ExtrapolationException
from tf2_py import InvalidArgumentException as InvalidArgumentException
from tf2_py import LookupException as LookupException
from tf2_py import TimeoutException as TimeoutException
from tf2_py import TransformException as TransformException
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

_LATER = {"BufferClient": "tf2_ros.buffer_client", "BufferServer": "tf2_ros.buffer_server"}


def __getattr__(name: str) -> _Any:
    """Names that need actionlib, which most programs do not use."""
    if name not in _LATER:
        raise AttributeError(f"module 'tf2_ros' has no attribute '{name}'")
    from importlib import import_module

    return getattr(import_module(_LATER[name]), name)

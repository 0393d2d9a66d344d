"""Drop-in replacement for Noetic's rospy, the ROS 1 client library for Python.

Scripts for genuine rospy run unchanged. The implementation is in `pipros.node`; this package provides the
names, arguments and exceptions that ROS users know.
"""

from pipros.basics import interrupts as _interrupts

_interrupts.install()  # before the other imports, during which Python may drop a Ctrl-C

# Noetic's rospy imports this submodule, so scripts that import only `importlib` can use it; `xml`: see below.
import importlib as _importlib
import importlib.util as _importlib_util  # noqa: F401
import typing as _typing
import xml as _xml

import pipros.startup as _startup  # noqa: F401 # installs the import hook, in case pipros.pth did not
from pipros.basics.lasting_imports import lasting_imports as _lasting_imports
from pipros.basics.lazy_names import lazy_names as _lazy_names
from pipros.basics.lazy_names import star_names as _star_names

with _lasting_imports():  # of nearly all modules, which need a tenth of a millisecond each
    from rospy import client as client

from rospy import core as core
from rospy import exceptions as exceptions
from rospy import impl as impl
from rospy import msg as msg
from rospy import msproxy as msproxy
from rospy import names as names
from rospy import rostime as rostime
from rospy import service as service
from rospy import timer as timer
from rospy import topics as topics
from rospy.client import delete_param as delete_param
from rospy.client import get_master as get_master
from rospy.client import get_param as get_param
from rospy.client import get_param_cached as get_param_cached
from rospy.client import get_param_names as get_param_names
from rospy.client import get_published_topics as get_published_topics
from rospy.client import has_param as has_param
from rospy.client import init_node as init_node
from rospy.client import myargv as myargv
from rospy.client import on_shutdown as on_shutdown
from rospy.client import search_param as search_param
from rospy.client import set_param as set_param
from rospy.client import spin as spin
from rospy.client import wait_for_message as wait_for_message
from rospy.core import get_node_uri as get_node_uri
from rospy.core import get_ros_root as get_ros_root
from rospy.core import is_shutdown as is_shutdown
from rospy.core import is_shutdown_requested as is_shutdown_requested
from rospy.core import parse_rosrpc_uri as parse_rosrpc_uri
from rospy.core import signal_shutdown as signal_shutdown
from rospy.exceptions import ROSException as ROSException
from rospy.exceptions import ROSInitException as ROSInitException
from rospy.exceptions import ROSInternalException as ROSInternalException
from rospy.exceptions import ROSInterruptException as ROSInterruptException
from rospy.exceptions import ROSSerializationException as ROSSerializationException
from rospy.exceptions import ROSTimeMovedBackwardsException as ROSTimeMovedBackwardsException
from rospy.exceptions import TransportException as TransportException
from rospy.exceptions import TransportInitError as TransportInitError
from rospy.exceptions import TransportTerminated as TransportTerminated
from rospy.logs import DEBUG as DEBUG
from rospy.logs import ERROR as ERROR
from rospy.logs import FATAL as FATAL
from rospy.logs import INFO as INFO
from rospy.logs import WARN as WARN
from rospy.logs import logdebug as logdebug
from rospy.logs import logdebug_once as logdebug_once
from rospy.logs import logdebug_throttle as logdebug_throttle
from rospy.logs import logdebug_throttle_identical as logdebug_throttle_identical
from rospy.logs import logerr as logerr
from rospy.logs import logerr_once as logerr_once
from rospy.logs import logerr_throttle as logerr_throttle
from rospy.logs import logerr_throttle_identical as logerr_throttle_identical
from rospy.logs import logfatal as logfatal
from rospy.logs import logfatal_once as logfatal_once
from rospy.logs import logfatal_throttle as logfatal_throttle
from rospy.logs import logfatal_throttle_identical as logfatal_throttle_identical
from rospy.logs import loginfo as loginfo
from rospy.logs import loginfo_once as loginfo_once
from rospy.logs import loginfo_throttle as loginfo_throttle
from rospy.logs import loginfo_throttle_identical as loginfo_throttle_identical
from rospy.logs import logout as logout
from rospy.logs import logwarn as logwarn
from rospy.logs import logwarn_once as logwarn_once
from rospy.logs import logwarn_throttle as logwarn_throttle
from rospy.logs import logwarn_throttle_identical as logwarn_throttle_identical
from rospy.msg import AnyMsg as AnyMsg
from rospy.msproxy import MasterProxy as MasterProxy
from rospy.names import get_caller_id as get_caller_id
from rospy.names import get_name as get_name
from rospy.names import get_namespace as get_namespace
from rospy.names import remap_name as remap_name
from rospy.names import resolve_name as resolve_name
from rospy.rostime import Duration as Duration
from rospy.rostime import Time as Time
from rospy.rostime import get_rostime as get_rostime
from rospy.rostime import get_time as get_time
from rospy.service import Service as Service
from rospy.service import ServiceException as ServiceException
from rospy.service import ServiceProxy as ServiceProxy
from rospy.service import wait_for_service as wait_for_service
from rospy.timer import Rate as Rate
from rospy.timer import Timer as Timer
from rospy.timer import sleep as sleep
from rospy.topics import Message as Message
from rospy.topics import Publisher as Publisher
from rospy.topics import SubscribeListener as SubscribeListener
from rospy.topics import Subscriber as Subscriber

# Few programs use this name, and importing it would load a message type at every start-up.
if _typing.TYPE_CHECKING:  # with __getattr__, type checkers would accept any name
    from std_msgs.msg import Header as Header
else:
    __getattr__, __dir__ = _lazy_names(__name__, {"Header": "std_msgs.msg"})


def _of_xml(name: str) -> object:
    """Import what Noetic's rospy imports of `xml` when a script uses it that imports only `xml`."""
    used = {"etree": "xml.etree.ElementTree", "parsers": "xml.parsers.expat"}.get(name)
    if used is None:
        raise AttributeError(f"module 'xml' has no attribute {name!r}")
    _importlib.import_module(used)
    return vars(_xml)[name]


_xml.__getattr__ = _of_xml  # type: ignore[method-assign] # not imported here, which takes 2 ms

_star_names(
    __name__,
    "std_msgs.msg:Header",
    hidden=(
        "ROSTimeMovedBackwardsException Timer before_init client core exceptions impl "
        "logdebug_throttle_identical logerr_throttle_identical logfatal_throttle_identical "
        "loginfo_throttle_identical logs logwarn_throttle_identical msg msproxy names node_logs node_start "
        "noetic_globals rostime service session shutdown_hooks signal_handlers timer topics wait_for_message"
    ),
)
_star_names(
    "rospy.core",
    "atexit inspect rosgraph_msgs.msg:Log hashlib:md5 os functools:partial pickle rosgraph rospkg rospy "
    "signal struct sys time traceback types urlparse=urllib.parse xmlrpcclient=xmlrpc.client",
)
_star_names("rospy.names", "os rosgraph struct sys")

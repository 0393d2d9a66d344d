"""`rospy.impl.masterslave`: names from genuine rospy's slave API, which `pipros.node.slave` implements."""

from __future__ import annotations

from pipros.basics.lazy_names import star_names as _star_names
from pipros.net.checked_calls import PUBLISHERS
from pipros.net.checked_calls import apivalidate as apivalidate
from rosgraph.xmlrpc import XmlRpcHandler as XmlRpcHandler
from rospy.core import *  # noqa: F403  # imported from here by other code
from rospy.impl.paramserver import get_param_server_cache as get_param_server_cache
from rospy.impl.registration import RegManager as RegManager
from rospy.impl.registration import get_topic_manager as get_topic_manager
from rospy.impl.transport import InternalOfRospy
from rospy.impl.validators import non_empty as non_empty

_star_names(
    __name__,
    "atexit errno inspect itertools rosgraph_msgs.msg:Log hashlib:md5 os functools:partial pickle rosgraph "
    "rospkg rospy signal socket struct sys time traceback types urlparse=urllib.parse "
    "xmlrpcclient=xmlrpc.client",
)

STATUS, MSG, VAL = 0, 1, 2
"""Indices of the code, message and value in a response."""

LOG_API = True


def is_publishers_list(paramName: str) -> tuple[str, str]:  # rospy's name for the check
    """Mark a parameter for which `apivalidate` requires a list of URIs."""
    return PUBLISHERS, paramName


class ROSHandler(InternalOfRospy, XmlRpcHandler):
    """Server of the slave API in genuine rospy."""

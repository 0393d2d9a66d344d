"""`roslib.names`: names of graph resources, types and packages; see `rosgraph.names` and `genmsg.names`."""

from genmsg.names import BASE_RESOURCE_NAME_LEGAL_CHARS_P as BASE_RESOURCE_NAME_LEGAL_CHARS_P
from genmsg.names import PRN_SEPARATOR as PRN_SEPARATOR
from genmsg.names import RESOURCE_NAME_LEGAL_CHARS_P as RESOURCE_NAME_LEGAL_CHARS_P
from genmsg.names import is_legal_resource_base_name as is_legal_resource_base_name
from genmsg.names import is_legal_resource_name as is_legal_resource_name
from genmsg.names import package_resource_name as package_resource_name
from genmsg.names import resource_name as resource_name
from genmsg.names import resource_name_base as resource_name_base
from genmsg.names import resource_name_package as resource_name_package
from rosgraph.names import ANYTYPE as ANYTYPE
from rosgraph.names import BASE_NAME_LEGAL_CHARS_P as BASE_NAME_LEGAL_CHARS_P
from rosgraph.names import GLOBALNS as GLOBALNS
from rosgraph.names import NAME_LEGAL_CHARS_P as NAME_LEGAL_CHARS_P
from rosgraph.names import PRIV_NAME as PRIV_NAME
from rosgraph.names import REMAP as REMAP
from rosgraph.names import SEP as SEP
from rosgraph.names import anonymous_name as anonymous_name
from rosgraph.names import canonicalize_name as canonicalize_name
from rosgraph.names import get_ros_namespace as get_ros_namespace
from rosgraph.names import is_global as is_global
from rosgraph.names import is_legal_base_name as is_legal_base_name
from rosgraph.names import is_legal_name as is_legal_name
from rosgraph.names import is_private as is_private
from rosgraph.names import isstring as isstring
from rosgraph.names import load_mappings as load_mappings
from rosgraph.names import make_caller_id as make_caller_id
from rosgraph.names import make_global_ns as make_global_ns
from rosgraph.names import namespace as namespace
from rosgraph.names import ns_join as ns_join
from rosgraph.names import resolve_name as resolve_name

TYPE_SEPARATOR = PRN_SEPARATOR

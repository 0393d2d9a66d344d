"""Names that loaders of launch files share."""

from __future__ import annotations

from rosgraph.names import canonicalize_name, is_legal_name, load_mappings, make_global_ns, ns_join
from roslaunch.core import PHASE_SETUP, Param, RLException, RosbinExecutable
from roslaunch.substitution_args import convert_value

__all__ = [
    "PHASE_SETUP",
    "PRIV_NAME",
    "LoadException",
    "Param",
    "RLException",
    "RosbinExecutable",
    "canonicalize_name",
    "convert_value",
    "is_legal_name",
    "load_mappings",
    "make_global_ns",
    "ns_join",
]

PRIV_NAME = "~"


class LoadException(RLException):
    """A resource of a launch file cannot be loaded."""

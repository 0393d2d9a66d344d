"""Drop-in replacement for Noetic's dynamic_reconfigure: parameters that can be changed while a node runs."""

from typing import Any as _Any

import pipros.startup as _startup  # noqa: F401 # installs the import hook, in case pipros.pth did not
from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "roslib")


class DynamicReconfigureException(Exception):
    """Base class of dynamic_reconfigure's exceptions."""


class DynamicReconfigureParameterException(DynamicReconfigureException):
    """A parameter does not exist, or does not accept a value."""


class DynamicReconfigureCallbackException(DynamicReconfigureException):
    """A server's callback failed, or returned no configuration."""


def find_reconfigure_services() -> list[str]:
    """Return the names of all servers in the graph."""
    import rosservice

    suffix = "/set_parameters"
    names = map(str, rosservice.get_service_list())
    return sorted(name.removesuffix(suffix) for name in names if name.endswith(suffix))


def get_parameter_names(descr: _Any) -> _Any:
    """Return the names of the parameters that a configuration module defines."""
    return descr.defaults.keys()

"""dynamic_reconfigure, as Noetic has it, on pipros: parameters that change while a node runs."""

from typing import Any as _Any

from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "roslib")


class DynamicReconfigureException(Exception):
    """Base of the errors of dynamic_reconfigure."""


class DynamicReconfigureParameterException(DynamicReconfigureException):
    """A parameter does not exist, or cannot have that value."""


class DynamicReconfigureCallbackException(DynamicReconfigureException):
    """A server's callback failed, or returned nothing."""


def find_reconfigure_services() -> list[str]:
    """The names of all servers of the graph."""
    import rosservice

    suffix = "/set_parameters"
    names = map(str, rosservice.get_service_list())
    return sorted(name.removesuffix(suffix) for name in names if name.endswith(suffix))


def get_parameter_names(descr: _Any) -> _Any:
    """The names of the parameters of a configuration's module."""
    return descr.defaults.keys()

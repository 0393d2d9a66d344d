"""ROS 1 from pip: master, client, messages, launch and tools, without a ROS installation.

Import the public names from here: `from pipros import Node`. docs/reference/python.md describes them. The
module that defines a name is imported when the name is first used.

PYTEST_DONT_REWRITE stops pytest from rewriting the asserts of this package. Otherwise, pytest would warn that
the package is already imported: pipros's import hook imports it when the interpreter starts.
"""

__version__ = "0.6.0"

__all__ = [
    "CallTimeout",
    "Core",
    "Environment",
    "Limits",
    "Master",
    "MasterClient",
    "Node",
    "NotFound",
    "PiprosError",
    "Publisher",
    "Refused",
    "ServiceClient",
    "ServiceFailed",
    "ServiceServer",
    "Subscriber",
    "Unreachable",
    "load_message_class",
    "load_service_class",
]

TYPE_CHECKING = False  # type checkers treat this as True; importing `typing` takes milliseconds
if TYPE_CHECKING:
    from pipros.basics.env import Environment
    from pipros.basics.errors import NotFound, PiprosError, Refused, Unreachable
    from pipros.basics.limits import Limits
    from pipros.master.master import Master
    from pipros.msg import load_message_class, load_service_class
    from pipros.net.master_client import MasterClient
    from pipros.node.node import Node
    from pipros.node.publisher import Publisher
    from pipros.node.service_client import ServiceClient
    from pipros.node.service_link import CallTimeout, ServiceFailed
    from pipros.node.service_server import ServiceServer
    from pipros.node.subscriber import Subscriber
    from pipros_tools.launch.roscore import Core

_MODULES = {
    "CallTimeout": "pipros.node.service_link",
    "Core": "pipros_tools.launch.roscore",
    "Environment": "pipros.basics.env",
    "Limits": "pipros.basics.limits",
    "Master": "pipros.master.master",
    "MasterClient": "pipros.net.master_client",
    "Node": "pipros.node.node",
    "NotFound": "pipros.basics.errors",
    "PiprosError": "pipros.basics.errors",
    "Publisher": "pipros.node.publisher",
    "Refused": "pipros.basics.errors",
    "ServiceClient": "pipros.node.service_client",
    "ServiceFailed": "pipros.node.service_link",
    "ServiceServer": "pipros.node.service_server",
    "Subscriber": "pipros.node.subscriber",
    "Unreachable": "pipros.basics.errors",
    "load_message_class": "pipros.msg",
    "load_service_class": "pipros.msg",
}


def __getattr__(name: str) -> object:
    module = _MODULES.get(name)
    if module is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    value: object = getattr(import_module(module), name)
    globals()[name] = value  # so that later uses do not call this function
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

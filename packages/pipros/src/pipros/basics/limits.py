"""Limits on the resources that peers can use, and on the sizes of files and names, with default values.

`PIPROS_LIMITS` changes limits for a process: `PIPROS_LIMITS="frame_bytes=1000000,goals=50"`. Programs may
pass a `Limits` to `Node` and `Master`. docs/reference/settings.md has a reason to change each. Limits that
nobody needs to change are constants beside the code that they bound.

Each plugin (`pipros.basics.plugins`) has its own limits in a NamedTuple, whose values `Limits.of` returns.
"""

import os
from functools import cache
from typing import Any, NamedTuple, TypeVar, cast

from pipros.basics.errors import PiprosError

VARIABLE = "PIPROS_LIMITS"

_KIB = 1024
_MIB = 1024 * _KIB

_Table = TypeVar("_Table")


class InvalidLimits(PiprosError, ValueError):
    """`PIPROS_LIMITS` names an unknown limit, or sets a limit to an invalid value."""


# Every command imports this module. Importing dataclasses would take longer than a call to the master, and so
# would string annotations, which NamedTuple compiles one by one.
class Limits(NamedTuple):
    """The limits for one process, node or master. `limits._replace(stall_s=1.0)` returns a changed copy.

    Each limit is a maximum size, number or time, unless noted otherwise.

    Attributes:
        frame_bytes: a message, a service request or a service reply; also all of a node's incomplete messages
            and service requests together.
        body_bytes: an XML-RPC request, or a response from a server that a peer chose.
        answer_bytes: an XML-RPC response from a server that the user chose: the master, or a node that a tool
            queries.
        login_s: the time for a client of a web page or bridge to send its request, and the same time again
            for the token.
        file_bytes: a file that is read whole, such as a launch file, a manifest, a message definition or a
            `CMakeLists.txt`.
        log_bytes: the log file of a node or launcher, `rosout.log` and `master.log`.
        log_files: a log file and its rotated predecessors, the most recent of which is `x.log.1`.
        goals: goals of an action server, including recently ended goals and goals cancelled in advance; also
            the queued cancellations of a ROS 2 action.
        launch_command_s: the time that the command of a `<param>` in a launch file may take.
        rpc_connections: XML-RPC connections to one server; 0 means half of the process's descriptors, or an
            eighth for a node.
        parameter_bytes: all parameters of a master together.
        notice_s: the time for a node to respond to a call from a master.
        tcpros_connections: TCPROS connections of a node, in either direction; 0 means three quarters of the
            process's descriptors.
        shared_bytes: the memory that a node shares with subscribers on this machine, for all topics together.
        incoming_links: links on which a node receives topics; each link needs a thread.
        service_threads: service calls that a node handles at a time; further calls wait.
        stall_s: the time that one `publish` waits, in total, for subscribers that do not keep up.
        queue_bytes: the messages queued for one subscriber, regardless of `queue_size`.
        definition_fields: fields and constants of all types in one definition, or of one type in a file. The
            fields of an embedded type count each time that it is embedded.
        bag_cache_bytes: the uncompressed chunks that are kept while a bag is read.
        tables: the limits of plugins, if they differ from the defaults; see `of`.
    """

    frame_bytes: int = 1024 * _MIB
    body_bytes: int = 16 * _MIB
    answer_bytes: int = 256 * _MIB
    login_s: float = 3.0
    file_bytes: int = 64 * _MIB
    log_bytes: int = 48 * _MIB
    log_files: int = 5
    goals: int = 1000
    launch_command_s: float = 60.0
    rpc_connections: int = 0
    parameter_bytes: int = 64 * _MIB
    notice_s: float = 10.0
    tcpros_connections: int = 0
    shared_bytes: int = 256 * _MIB
    incoming_links: int = 1024
    service_threads: int = 256
    stall_s: float = 2.0
    queue_bytes: int = 256 * _MIB
    definition_fields: int = 3000
    bag_cache_bytes: int = 256 * _MIB
    tables: tuple[Any, ...] = ()

    def of(self, table: type[_Table]) -> _Table:
        """Return the limits of a plugin: the values in `tables`, or else the defaults of its class."""
        return next((each for each in self.tables if type(each) is table), None) or table()

    def with_table(self, table: Any) -> "Limits":
        """Return a copy in which these limits of a plugin replace the previous ones."""
        others = (each for each in self.tables if type(each) is not type(table))
        return self._replace(tables=(*others, table))

    @classmethod
    def parse(cls, text: str) -> "Limits":
        """Read `name=value` pairs, separated by commas; all other limits keep their defaults.

        A name is a field of this class, or of the class that defines the limits of an installed plugin.

        Raises:
            InvalidLimits: a name is unknown, or a value is not a number greater than zero. 0 is allowed if it
                is the default.

        Examples:
            >>> Limits.parse("frame_bytes=1000, stall_s=0.5").stall_s
            0.5
        """
        limits: Any = cls()
        for pair in filter(None, map(str.strip, text.split(","))):
            name, _, value = (part.strip() for part in pair.partition("="))
            if name in names_in(cls):
                limits = limits._replace(**{name: _number(name, value, cls)})
                continue
            table = next((each for each in plugin_tables() if name in names_in(each)), None)
            if table is None:
                known = ", ".join(name for each in (cls, *plugin_tables()) for name in names_in(each))
                raise InvalidLimits(f"{VARIABLE}: unknown limit [{name}]; the limits are {known}")
            changed = limits.of(table)._replace(**{name: _number(name, value, table)})
            limits = limits.with_table(changed)
        return cast("Limits", limits)


def names_in(table: Any) -> list[str]:
    """Return the names of the limits in `Limits` or in a plugin's class."""
    return [name for name in table._fields if name != "tables"]


def plugin_tables() -> list[Any]:
    """Return the classes that define the limits of the installed plugins."""
    from pipros.basics.plugins import all_loaded

    return all_loaded(lambda plugin: plugin.limits)


def _number(name: str, text: str, table: Any) -> float:
    default = table._field_defaults[name]
    kind = int if isinstance(default, int) else float
    try:
        value = kind(text)
        is_valid = value > 0 or value == default
    except ValueError:
        is_valid = False
    if not is_valid:
        wanted = "a whole number" if kind is int else "a number"
        rule = "greater than zero" if default else ">= 0"
        raise InvalidLimits(f"{VARIABLE}: {name} must be {wanted} {rule}, got [{text}]")
    return value


def limit_text(name: str, value: float) -> str:
    """Return the part of an error text that names a limit and how to change it.

    Examples:
        >>> limit_text("body_bytes", 1000)
        'the limit is 1000 (body_bytes in PIPROS_LIMITS)'
    """
    return f"the limit is {value} ({name} in {VARIABLE})"


@cache
def process_limits() -> Limits:
    """Return the limits of this process: `PIPROS_LIMITS`, read once, on first use.

    Raises:
        InvalidLimits: see `Limits.parse`.
    """
    return Limits.parse(os.environ.get(VARIABLE, ""))

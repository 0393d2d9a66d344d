"""Limits on the resources that peers can use, and on the sizes of files and names, with default values.

`PIPROS_LIMITS` changes limits for a process: `PIPROS_LIMITS="frame_bytes=1000000,handshakes=64"`. Programs
may pass a `Limits` to `Node` and `Master`. docs/reliability.md describes what happens at each limit.

Each room (`pipros.basics.rooms`) defines its own limits in a NamedTuple, whose values `Limits.of` returns.
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
        header_bytes: size of a TCPROS connection header.
        frame_bytes: a message, a service request or a service reply; also all of a node's incomplete messages
            and service requests together.
        handshakes: concurrent connections to a node on which neither a TCPROS header nor the beginning of an
            HTTP request has arrived yet; at most a quarter of `tcpros_connections`.
        handshake_s: the time in which a TCPROS header or the beginning of an HTTP request must arrive; also
            the time in which a peer to which the node connects must reply with its header.
        body_bytes: an XML-RPC request, or a response from a server that a peer chose.
        answer_bytes: an XML-RPC response from a server that the user chose: the master, or a node that a tool
            queries.
        bodies_bytes: all incomplete XML-RPC requests to one server together; also, separately, all of a
            node's service replies that clients have not read.
        request_s: the time for an XML-RPC request to arrive, and for its sender to read the response; also
            for service calls, for which it restarts after every MiB.
        login_s: the time for a client of a web page or bridge to send its request, and the same time again
            for the token.
        login_bytes: the bytes that a client of a web page or bridge may send before it has logged in.
        idle_s: the time that an XML-RPC connection may stay open without a request.
        file_bytes: a file that is read whole, such as a launch file, a manifest, a message definition or a
            `CMakeLists.txt`.
        cmake_steps: commands and loop iterations that one package's `CMakeLists.txt` executes.
        cmake_rounds: iterations of one loop in a `CMakeLists.txt`.
        cmake_depth: nesting of a package's CMake files and functions.
        cmake_value_characters: the value of one CMake variable, or the arguments of one command.
        cmake_characters: all of a package's CMake variables together.
        log_bytes: the log file of a node or launcher, `rosout.log` and `master.log`.
        log_files: a log file and its rotated predecessors, the most recent of which is `x.log.1`.
        goals: goals of an action server, including recently ended goals and goals cancelled in advance; also
            the queued cancellations of a ROS 2 action. `name_characters` limits the length of goal ids.
        launch_bytes: the files and command outputs that one launch reads, and the text that its substitutions
            insert, together.
        launch_command_s: the time that the command of a `<param>` in a launch file may take.
        launch_includes: `<include>`s in one launch.
        launch_insert_characters: the text that all substitutions in one attribute or element insert.
        loggers: loggers that callers of `~set_logger_level` create in a node.
        multicall_answer_bytes: all responses to one `system.multicall` together.
        rpc_connections: XML-RPC connections to one server; 0 means half of the process's descriptors, or an
            eighth for a node.
        rpc_connections_per_peer: XML-RPC connections to one server from one address.
        name_characters: a name or a URI in a call to the master.
        parameter_bytes: all parameters of a master together.
        registration_bytes: the names, types and URIs of all registrations of a master together.
        topic_types: types that a master keeps for topics that have neither publishers nor subscribers.
        topic_type_bytes: the names and types of all these topics together.
        notices: calls that a master has queued for one node.
        notice_s: the time for a node to respond to a call from a master.
        tcpros_connections: TCPROS connections of a node, in either direction; 0 means three quarters of the
            process's descriptors.
        tcpros_connections_per_peer: the TCPROS connections that one address may open; 0 means half of the
            difference between `tcpros_connections` and `handshakes`, or all of it for loopback.
        shared_topic_bytes: the memory that a node shares with the subscribers of one topic on this machine.
            Messages that do not fit are sent through sockets.
        shared_bytes: the same for all topics of a node together.
        incoming_links: links on which a node receives topics; each link needs a thread.
        connection_attempts: publishers that a node tries to connect to at the same time.
        publishers_per_topic: publishers on one topic to which a node connects.
        service_threads: service calls that a node handles at a time; further calls wait.
        statistics_links: links for which topic statistics are kept.
        lookup_s: the time for looking up a configured host name to determine whether it belongs to this
            machine.
        recheck_s: the time after which a node that has queried its master about untrusted callers may query
            it again.
        stall_s: the time that one `publish` waits, in total, for subscribers that do not keep up.
        queue_bytes: the messages queued for one subscriber, regardless of `queue_size`.
        lookups: concurrent lookups of host names.
        subscriber_bytes: the bytes that a subscriber may send on a topic link after its header.
        definition_bytes: the text of a message definition from a peer or a bag.
        definition_cache_bytes: definitions from peers and bags whose classes are kept for further messages.
        definition_types: types in one definition.
        definition_fields: fields and constants of all types in one definition, or of one type in a file. The
            fields of an embedded type count each time that it is embedded.
        definition_copies_bytes: the definitions of all types in one definition, each including its embedded
            types.
        bag_header_bytes: the header of one record in a bag.
        bag_connection_bytes: a connection header, or the list of a chunk's connections, in a bag.
        bag_chunk_bytes: one chunk of a bag, uncompressed.
        bag_expanded_bytes: one chunk of a bag, uncompressed, if it is more than 1,000 times as large as the
            compressed chunk.
        bag_index_bytes: index entries of messages that are found by reading chunks, in addition to 16 bytes
            for each byte of the file.
        bag_cache_bytes: the uncompressed chunks that are kept while a bag is read.
        edit_method_characters: the constants of one dynamic_reconfigure enum.
        bus_answer_bytes: a node's report on its connections, for tools that show the graph.
        launch_answer_bytes: a response from roslaunch to the web page, with its nodes or one node's output.
        message_values: values in a new message.
        empty_elements: values in one message, in addition to eight for each of its bytes.
        transform_chains_bytes: the approximate size of the paths between frames that one tf buffer remembers.
        transform_bytes: the approximate size of the frames and transforms in one tf buffer.
        yaml_values: values in a YAML text. Aliases and merged mappings count each time they are used.
        yaml_depth: nesting of lists and mappings in a YAML text.
        xml_bytes: an XML file.
        xml_depth: nesting of elements in an XML file.
        expression_characters: the text of one `$(eval ...)`, message filter or CMake `math`.
        expression_size: characters of a string, or elements of a nested list, that an expression builds.
        expression_work: the sizes of all values that an expression builds, plus a charge for steps that take
            longer than their results' sizes suggest.
        policy_file_bytes: a policy file; this also limits the number of its rules.
        policy_values: values of a message that are compared with a policy.
        policy_stop_bytes: a message or service request with which a policy stops the robot.
        policy_stops: topics, services and goals that a server has yet to stop when their time is up.
        policy_goal_id_characters: the id of a goal with a time limit.
        tables: the limits of rooms, if they differ from the defaults; see `of`.
    """

    header_bytes: int = 1 * _MIB
    frame_bytes: int = 1024 * _MIB
    handshakes: int = 256
    handshake_s: float = 10.0
    body_bytes: int = 16 * _MIB
    answer_bytes: int = 256 * _MIB
    bodies_bytes: int = 256 * _MIB
    request_s: float = 30.0
    login_s: float = 3.0
    login_bytes: int = 64 * _KIB
    idle_s: float = 900.0
    file_bytes: int = 64 * _MIB
    cmake_steps: int = 2_000_000
    cmake_rounds: int = 100_000
    cmake_depth: int = 50
    cmake_value_characters: int = 4 * 1024 * 1024
    cmake_characters: int = 64 * 1024 * 1024
    log_bytes: int = 48 * _MIB
    log_files: int = 5
    goals: int = 1000
    launch_bytes: int = 512 * _MIB
    launch_command_s: float = 60.0
    launch_includes: int = 10_000
    launch_insert_characters: int = 1024 * 1024
    loggers: int = 1000
    multicall_answer_bytes: int = 16 * _MIB
    rpc_connections: int = 0
    rpc_connections_per_peer: int = 4096
    name_characters: int = 16 * _KIB
    parameter_bytes: int = 64 * _MIB
    registration_bytes: int = 128 * _MIB
    topic_types: int = 10_000
    topic_type_bytes: int = 1 * _MIB
    notices: int = 1000
    notice_s: float = 10.0
    tcpros_connections: int = 0
    tcpros_connections_per_peer: int = 0
    shared_topic_bytes: int = 64 * _MIB
    shared_bytes: int = 256 * _MIB
    incoming_links: int = 1024
    connection_attempts: int = 20
    publishers_per_topic: int = 2000
    service_threads: int = 256
    statistics_links: int = 1000
    lookup_s: float = 5.0
    recheck_s: float = 1.0
    stall_s: float = 2.0
    queue_bytes: int = 256 * _MIB
    lookups: int = 64
    subscriber_bytes: int = 4 * _KIB
    definition_bytes: int = 4 * _MIB
    definition_cache_bytes: int = 64 * _MIB
    definition_types: int = 1000
    definition_fields: int = 3000
    definition_copies_bytes: int = 64 * _MIB
    bag_header_bytes: int = 1 * _MIB
    bag_connection_bytes: int = 16 * _MIB
    bag_chunk_bytes: int = 2048 * _MIB
    bag_expanded_bytes: int = 128 * _MIB
    bag_index_bytes: int = 16 * _MIB
    bag_cache_bytes: int = 256 * _MIB
    edit_method_characters: int = 100_000
    bus_answer_bytes: int = 8 * _MIB
    launch_answer_bytes: int = 4 * _MIB
    message_values: int = 4 * 1024 * 1024
    empty_elements: int = 65_536
    transform_chains_bytes: int = 4 * _MIB
    transform_bytes: int = 1024 * _MIB
    yaml_values: int = 1_000_000
    yaml_depth: int = 100
    xml_bytes: int = 16 * _MIB
    xml_depth: int = 100
    expression_characters: int = 4_000
    expression_size: int = 100_000
    expression_work: int = 2_000_000
    policy_file_bytes: int = 256 * _KIB
    policy_values: int = 10_000
    policy_stop_bytes: int = 1 * _KIB
    policy_stops: int = 1_000
    policy_goal_id_characters: int = 200
    tables: tuple[Any, ...] = ()

    def of(self, table: type[_Table]) -> _Table:
        """Return the limits of a room: the values in `tables`, or else the defaults of its class."""
        return next((each for each in self.tables if type(each) is table), None) or table()

    def with_table(self, table: Any) -> "Limits":
        """Return a copy in which these limits of a room replace the previous ones."""
        others = (each for each in self.tables if type(each) is not type(table))
        return self._replace(tables=(*others, table))

    @classmethod
    def parse(cls, text: str) -> "Limits":
        """Read `name=value` pairs, separated by commas; all other limits keep their defaults.

        A name is a field of this class, or of the class that defines the limits of an installed room.

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
            table = next((each for each in room_tables() if name in names_in(each)), None)
            if table is None:
                known = ", ".join(name for each in (cls, *room_tables()) for name in names_in(each))
                raise InvalidLimits(f"{VARIABLE}: unknown limit [{name}]; the limits are {known}")
            changed = limits.of(table)._replace(**{name: _number(name, value, table)})
            limits = limits.with_table(changed)
        return cast("Limits", limits)


def names_in(table: Any) -> list[str]:
    """Return the names of the limits in `Limits` or in a room's class."""
    return [name for name in table._fields if name != "tables"]


def room_tables() -> list[Any]:
    """Return the classes that define the limits of the installed rooms."""
    from pipros.basics.rooms import all_loaded

    return all_loaded(lambda room: room.limits)


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

"""All limits on the resources that peers, files and names can use, with their defaults.

`PIPROS_LIMITS` changes them for a process: `PIPROS_LIMITS="frame_bytes=1000000,handshakes=64"`. Programs
may pass a `Limits` to `Node` and `Master`. docs/reliability.md describes what happens at each limit.
"""

import os
from functools import cache
from typing import NamedTuple

from pipros.basics.errors import PiprosError

VARIABLE = "PIPROS_LIMITS"

_KIB = 1024
_MIB = 1024 * _KIB


class InvalidLimits(PiprosError, ValueError):
    """`PIPROS_LIMITS` names an unknown limit, or sets a limit to an invalid value."""


# Every command imports this module. Importing dataclasses would take longer than a call to the master, and so
# would string annotations, which a NamedTuple compiles one by one.
class Limits(NamedTuple):
    """The limits for one process, node or master. `limits._replace(stall_s=1.0)` returns a changed copy.

    Each limit is the maximum size, number or time of what it describes, unless noted otherwise.

    Attributes:
        header_bytes: size of a TCPROS connection header.
        frame_bytes: a message, a service request or a service reply.
        handshakes: concurrent connections to a node on which neither a TCPROS header nor the beginning of an
            HTTP request has arrived yet.
        handshake_s: the time in which a TCPROS header or the beginning of an HTTP request must arrive; also
            for the header of a peer that the node connects to.
        body_bytes: an XML-RPC request.
        answer_bytes: an XML-RPC response from a server that the user chose: the master, or a node that a tool
            queries.
        bodies_bytes: all incomplete XML-RPC requests to one server together; also all of a node's service
            replies that clients have not read.
        request_s: the time for an XML-RPC request to arrive, and for its sender to read the response; also
            for service calls, for which it restarts after every MiB.
        login_s: the time for a page's client to send its request, and the same time again to send the token.
        login_bytes: the bytes that a page's client may send before it has logged in.
        idle_s: the time that an XML-RPC connection may stay open without a request.
        file_bytes: a file that is read whole: a launch file, a manifest, a definition, a `CMakeLists.txt`.
        cmake_steps: commands and loop iterations that one package's `CMakeLists.txt` executes.
        cmake_rounds: iterations of one loop in a `CMakeLists.txt`.
        cmake_depth: nesting of a package's CMake files and functions.
        cmake_value_characters: the value of one CMake variable, or the arguments of one command.
        cmake_characters: all of a package's CMake variables together.
        log_bytes: the log file of a node or launcher, `rosout.log` and `master.log`.
        log_files: a log file and its rotated predecessors. `x.log.1` is the most recent of these.
        goals: goals of an action server, including recently ended goals and goals cancelled in advance. Goal
            ids are limited to `name_characters`. Also the queued cancellations of a ROS 2 action.
        launch_bytes: files and command outputs that one launch reads, and the text that substitutions insert.
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
        topic_types: types that a master keeps for topics that have no publishers or subscribers.
        topic_type_bytes: the names and types of all such topics together.
        notices: calls that a master has queued for one node.
        notice_s: the time for a node to respond to such a call.
        tcpros_connections: TCPROS connections of a node, in either direction; 0 means three quarters of the
            process's descriptors.
        tcpros_connections_per_peer: the TCPROS connections that one address may open; 0 means half of
            `tcpros_connections`, or all of them for loopback.
        incoming_links: publishers that a node receives from; each needs a thread.
        connection_attempts: publishers that a node tries to connect to at the same time.
        publishers_per_topic: publishers on one topic that a node connects to.
        service_threads: service calls that a node handles at a time; further calls wait.
        statistics_links: links for which topic statistics are kept.
        lookup_s: the time for looking up a configured host name to determine whether it belongs to this
            machine.
        recheck_s: the shortest interval at which a node queries its master because of unknown callers.
        stall_s: the time that one `publish` waits, in total, for subscribers that do not keep up.
        queue_bytes: the messages queued for one subscriber, regardless of `queue_size`.
        lookups: concurrent lookups of host names.
        subscriber_bytes: the bytes that a subscriber may send on a topic link after its header.
        definition_bytes: the text of a message definition from a peer or a bag.
        definition_cache_bytes: definitions whose classes are kept for the next message.
        definition_types: types in one definition.
        definition_fields: fields and constants of all types in one definition, or of one type in a file.
            Fields of embedded types count each time.
        definition_copies_bytes: the definitions of all types in one definition, each including its embedded
            types.
        bag_header_bytes: the header of one record in a bag.
        bag_connection_bytes: a connection header, or the list of a chunk's connections, in a bag.
        bag_chunk_bytes: one chunk of a bag, uncompressed.
        bag_expanded_bytes: one chunk of a bag, uncompressed, if it expands more than 1,000 times.
        bag_index_bytes: index entries of messages that are found by reading chunks, beyond 16 bytes for each
            byte of the file.
        bag_cache_bytes: the uncompressed chunks that are kept while a bag is read.
        edit_method_characters: the constants of one dynamic_reconfigure enum.
        bus_answer_bytes: a node's report on its connections, for tools that show the graph.
        launch_answer_bytes: a response from roslaunch to the page, with its nodes or one node's output.
        page_message_bytes: a message that a page decodes.
        page_view_bytes: data that a page keeps for one of its tabs, such as log entries, diagnostics or
            parameters; also the messages of one topic that are kept after a jump in a bag.
        page_layout_bytes: a panel layout, stored by a browser or in a file.
        page_topics: topics that all browsers connected to a page watch together.
        page_bags: bags that all browsers connected to a page have opened together.
        page_record_spare_bytes: free disk space below which a page's recording ends.
        page_export_bytes: the messages that a browser exports from a bag.
        page_exports: concurrent exports by all browsers connected to a page; each needs a temporary file.
        scene_resource_bytes: a mesh or a texture that the page's scene reads from a package.
        bridge_clients: clients of all rosbridge and Foxglove servers in a process.
        bridge_topics: topics that all these clients receive together.
        bridge_subscriptions: subscriptions of one client; also the topics and services that it advertises.
        bridge_queue_bytes: the messages and responses queued for one client.
        bridge_message_bytes: a message from a client.
        bridge_reader_bytes: a message from a client that may not change the system.
        bridge_parsed_bytes: the approximate memory for a client's parsed message; for a client that may not
            change the system, a quarter of it.
        bridge_asset_bytes: an asset that a Foxglove client fetches; also half of all that are being sent.
        bridge_kept_bytes: the names and ids that one client makes a server keep.
        bridge_client_bytes: everything that a server holds for one client: incomplete, parsed and queued
            messages, names and ids. If larger, the sum of `bridge_queue_bytes` and three messages.
        bridge_total_bytes: the same for all clients of a server, beyond 256 KiB for each. A client gets at
            most half of what the others leave.
        zenoh_message_bytes: a message from ROS 2 through Zenoh, and all static transforms of ROS 2.
        bridge_stall_s: the time for which a client may leave a full connection unread.
        bridge_client_rate: messages per second that a client may send; faster clients are slowed down.
        bridge_client_rate_bytes: bytes per second that a client may send; faster clients are slowed down.
        ros2_discovery_bytes: all stored announcements of ROS 2 participants and endpoints.
        ros2_peer_bytes: the announcements of one participant.
        ros2_graph_bytes: the endpoints of other processes that a gateway to ROS 2 remembers.
        ros2_sample_bytes: a message from ROS 2.
        ros2_incomplete_bytes: fragments and early messages of one participant, until they are complete.
        ros2_incomplete_total_bytes: fragments and early messages of all participants together.
        ros2_history_bytes: the messages that one writer keeps for ROS 2 readers.
        ros2_backlog_bytes: datagrams from ROS 2 that a participant has read but not yet handled.
        ros2_inbox_bytes: ROS 2 messages that are queued for one callback, or requests queued for one service.
        fleet_file_bytes: a fleet member's YAML file.
        fleet_members: other members of a fleet that a member shows.
        fleet_topics: topics and services of these members, in total.
        fleet_directory_bytes: a member's directory of the topics and services that it offers.
        fleet_message_bytes: a message, a request or a reply on a fleet link, compressed or decompressed.
        fleet_queue_bytes: messages waiting to be sent over a fleet link.
        fleet_latched_bytes: latched messages that a member keeps for others.
        fleet_definition_bytes: the other members' message definitions that a member keeps, or that a router
            keeps for its history.
        fleet_history_files: files in a router's history, for all members together.
        fleet_calls: calls from other members that a member handles at a time.
        message_values: values in a new message.
        empty_elements: values in one message, beyond eight for each of its bytes.
        turtles: turtles in one turtlesim.
        simulated_robots: robots in one simulation.
        teleports: teleports queued for one turtle until the next tick.
        transform_chains_bytes: the approximate size of the paths between frames that one tf buffer remembers.
        transform_bytes: the approximate size of the frames and transforms in one tf buffer.
        yaml_values: values in a YAML text. Aliases and merged mappings count each time they are used.
        yaml_depth: nesting of lists and mappings in a YAML text; the parameter server has the same limit.
        xml_bytes: an XML file.
        xml_depth: nesting of elements in an XML file.
        expression_characters: the text of one `$(eval ...)`, message filter or CMake `math`.
        expression_size: characters of a string, or elements of a nested list, that an expression builds.
        expression_work: the sizes of all values that an expression builds, plus a charge for steps that take
            longer than their results' sizes suggest.
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
    page_message_bytes: int = 128 * _MIB
    page_view_bytes: int = 8 * _MIB
    page_layout_bytes: int = 65_536
    page_topics: int = 500
    page_bags: int = 20
    page_record_spare_bytes: int = 1024 * _MIB
    page_export_bytes: int = 512 * _MIB
    page_exports: int = 2
    scene_resource_bytes: int = 100 * _MIB
    bridge_clients: int = 250
    bridge_topics: int = 1000
    bridge_subscriptions: int = 2000
    bridge_queue_bytes: int = 16 * _MIB
    bridge_message_bytes: int = 10 * _MIB
    bridge_reader_bytes: int = 1 * _MIB
    bridge_parsed_bytes: int = 32 * _MIB
    bridge_asset_bytes: int = 48 * _MIB
    bridge_kept_bytes: int = 4 * _MIB
    bridge_client_bytes: int = 48 * _MIB
    bridge_total_bytes: int = 160 * _MIB
    zenoh_message_bytes: int = 64 * _MIB
    bridge_stall_s: float = 10.0
    bridge_client_rate: int = 10_000
    bridge_client_rate_bytes: int = 256 * _MIB
    ros2_discovery_bytes: int = 32 * _MIB
    ros2_peer_bytes: int = 4 * _MIB
    ros2_sample_bytes: int = 128 * _MIB
    ros2_incomplete_bytes: int = 256 * _MIB
    ros2_incomplete_total_bytes: int = 512 * _MIB
    ros2_history_bytes: int = 256 * _MIB
    ros2_backlog_bytes: int = 64 * _MIB
    ros2_inbox_bytes: int = 256 * _MIB
    ros2_graph_bytes: int = 16 * _MIB
    fleet_file_bytes: int = 256 * _KIB
    fleet_members: int = 1000
    fleet_topics: int = 5000
    fleet_directory_bytes: int = 4 * _MIB
    fleet_message_bytes: int = 64 * _MIB
    fleet_queue_bytes: int = 32 * _MIB
    fleet_latched_bytes: int = 64 * _MIB
    fleet_definition_bytes: int = 64 * _MIB
    fleet_history_files: int = 10_000
    fleet_calls: int = 64
    message_values: int = 4 * 1024 * 1024
    empty_elements: int = 65_536
    turtles: int = 100
    simulated_robots: int = 100
    teleports: int = 1000
    transform_chains_bytes: int = 4 * _MIB
    transform_bytes: int = 1024 * _MIB
    yaml_values: int = 1_000_000
    yaml_depth: int = 100
    xml_bytes: int = 16 * _MIB
    xml_depth: int = 100
    expression_characters: int = 4_000
    expression_size: int = 100_000
    expression_work: int = 2_000_000

    @classmethod
    def parse(cls, text: str) -> "Limits":
        """Read `name=value` pairs, separated by commas; all other limits keep their defaults.

        Raises:
            InvalidLimits: a name is unknown, or a value is not a number greater than zero. 0 is allowed if it
                is the default.

        Examples:
            >>> Limits.parse("frame_bytes=1000, stall_s=0.5").stall_s
            0.5
        """
        known = cls._field_defaults
        changed: dict[str, float] = {}
        for pair in filter(None, map(str.strip, text.split(","))):
            name, _, value = (part.strip() for part in pair.partition("="))
            if name not in known:
                raise InvalidLimits(f"{VARIABLE}: unknown limit [{name}]; the limits are {', '.join(known)}")
            default = known[name]
            kind = int if isinstance(default, int) else float
            try:
                changed[name] = kind(value)
                is_valid = changed[name] > 0 or changed[name] == default
            except ValueError:
                is_valid = False
            if not is_valid:
                wanted = "a whole number" if kind is int else "a number"
                raise InvalidLimits(f"{VARIABLE}: {name} must be {wanted} greater than zero, got [{value}]")
        return cls(**changed)  # type: ignore[arg-type]  # each has its field's type


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

"""Query the master and every registered node, publisher and service in a running system.

The system is not changed.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

from pipros.basics.errors import PiprosError, Refused, Unreachable
from pipros.basics.uri import split_uri
from pipros.msg import load_service_class
from pipros.msg.importing.load import installed_md5
from pipros.net.in_parallel import in_parallel
from pipros.net.master_client import MasterClient
from pipros.net.rpc_client import RpcClient
from pipros.node.open_calls import OpenCalls
from pipros.node.service_client import ServiceClient
from pipros.wire.xmlrpc import encode_call
from pipros_tools.graph.bus_info import established
from pipros_tools.graph.errors import GraphError
from pipros_tools.graph.services import PROBE_DEADLINE_S, header_of, was_silent
from pipros_tools.graph.system_state import SystemState
from pipros_tools.health.gather_publisher import CALLER_ID, ask_publisher, failure_of
from pipros_tools.health.nodelet_checks import services_of_managers
from pipros_tools.health.plugin_check import PluginCheck, PluginReply, plugin_checks
from pipros_tools.health.system_report import Failure, NodeReport, ServiceReport, SystemReport

AT_ONCE = 64
"""Maximum number of nodes queried concurrently. A node that does not answer keeps a thread for the whole
timeout, which costs no more than its memory.
"""


_NODELETS = 1000  # maximum number of lines in a manager's reply
_LONGEST_REQUEST_S = 2.0  # after a longer delay, a response's date is too imprecise


def gather_system(master_uri: str, *, topic: str | None = None, timeout_s: float = 3.0) -> SystemReport:
    """Return the current state of the system that uses a master.

    If a topic is given, only its nodes are queried, and only the services of nodelet managers and plugins.
    Blocks up to `timeout_s` for each node that does not answer; nodes are queried concurrently.

    Raises:
        Unreachable: the master does not answer.
    """
    master = MasterClient(master_uri, CALLER_ID, timeout_s=max(timeout_s, 10.0))
    try:
        state = SystemState.from_state(master.get_system_state())
        types = dict(master.get_topic_types())
        system = SystemReport(master_uri, state, types, is_time_simulated=_is_simulated(master))
        asked = state if topic is None else state.of_topic(topic)
        silent: dict[str, Failure] = {}
        nodes = in_parallel(
            asked.nodes(), lambda node: _ask_node(master, node, timeout_s, silent), at_once=AT_ONCE
        )
        ends = [
            (name, node)
            for name, senders in asked.publishers.items()
            for node in senders
            if nodes[node].failure is None
        ]
        publishers = in_parallel(
            ends, lambda end: ask_publisher(end[0], nodes[end[1]].api, timeout_s), at_once=AT_ONCE
        )
        servers = {name: names[0] for name, names in asked.services.items() if names}
        clock_offset_s = _clock_offset(master_uri, timeout_s)
        services = in_parallel(
            servers, lambda name: _ask_service(master, name, servers[name], silent), at_once=AT_ONCE
        )
        checks = plugin_checks()
        judged = {
            node: check
            for node in nodes
            for check in checks
            if node.startswith(check.prefix) and not nodes[node].failure
        }
        plugin_replies = in_parallel(
            judged, lambda node: _ask_plugin(master, node, judged[node], timeout_s), at_once=AT_ONCE
        )
        replies = in_parallel(
            services_of_managers(state), lambda name: _ask_manager(master, name, timeout_s), at_once=AT_ONCE
        )
    finally:
        master.close()
    named = {*types.values(), *(publisher.type for publisher in publishers.values() if publisher.type)} - {
        "*",
        "",
    }
    return replace(
        system,
        nodes=nodes,
        publishers=publishers,
        services=services,
        clock_offset_s=clock_offset_s,
        plugin_replies=plugin_replies,
        nodelets=tuple(line for name in sorted(replies) for line in replies[name]),
        installed={type_name: installed_md5(type_name) for type_name in sorted(named)},
    )


def _is_simulated(master: MasterClient) -> bool:
    try:
        return bool(master.get_param("/use_sim_time"))
    except Refused:
        return False


def _ask_node(master: MasterClient, node: str, timeout_s: float, silent: dict[str, Failure]) -> NodeReport:
    """Call a node, unless its address is in `silent`, to which an address that times out is added."""
    try:
        api = master.lookup_node(node)
    except PiprosError as problem:
        return NodeReport("", Failure(str(problem)))
    if api in silent:
        return NodeReport(api, silent[api])
    began_s = time.monotonic()
    try:
        with RpcClient(api, timeout_s=timeout_s) as client:
            client.call("getPid", CALLER_ID)
            return NodeReport(
                api,
                master_uri=_text(_value(client, "getMasterUri")),
                connections=tuple(established(_value(client, "getBusInfo"))),
                subscriptions=_pairs(_value(client, "getSubscriptions")),
                publications=_pairs(_value(client, "getPublications")),
            )
    except (PiprosError, ValueError) as problem:
        failure = failure_of(problem)
        if was_silent(began_s, timeout_s):
            silent[api] = failure
        return NodeReport(api, failure)


def _value(client: RpcClient, method: str) -> Any:
    """Return the value in a node's response, or None if the node reports an error or lacks the method."""
    try:
        answer = client.call(method, CALLER_ID)
    except Unreachable:
        raise
    except PiprosError:
        return None
    is_good = isinstance(answer, list) and len(answer) == 3 and answer[0] == 1
    return answer[2] if is_good else None


def _text(value: Any) -> str:
    return value if isinstance(value, str) else ""


def _pairs(value: Any) -> dict[str, str]:
    rows = value if isinstance(value, list) else []
    return {str(row[0]): str(row[1]) for row in rows if isinstance(row, list) and len(row) == 2}


def _origin(problem: Exception) -> Exception:
    """Return the operating system error that caused an exception, or the first exception in its chain."""
    while not isinstance(problem, OSError) and isinstance(problem.__context__, Exception):
        problem = problem.__context__
    return problem


def _clock_offset(uri: str, timeout_s: float) -> float | None:
    """Return the master's clock minus this machine's, in s, from a response's `Date`, or None if unknown."""
    from email.utils import parsedate_to_datetime
    from http.client import HTTPConnection, HTTPException

    host, port, path = split_uri(uri)
    connection = HTTPConnection(host, port, timeout=timeout_s)
    try:
        body = encode_call("getPid", (CALLER_ID,))
        before = time.time()
        connection.request("POST", path, body, {"Content-Type": "text/xml"})
        date = connection.getresponse().getheader("Date")
        after = time.time()
        if date is None or after - before > _LONGEST_REQUEST_S:
            return None
        # the date has a resolution of 1 s
        return parsedate_to_datetime(date).timestamp() + 0.5 - (before + after) / 2
    except (OSError, HTTPException, ValueError):
        return None
    finally:
        connection.close()


def _ask_service(master: MasterClient, service: str, node: str, silent: dict[str, Failure]) -> ServiceReport:
    uri = ""
    began_s = time.monotonic()
    try:
        uri = master.lookup_service(service)
        if uri in silent:
            return ServiceReport(node, uri, silent[uri])
        header_of(master, service)
    except GraphError as problem:
        failure = failure_of(_origin(problem))
        if was_silent(began_s, PROBE_DEADLINE_S):
            silent[uri] = failure
        return ServiceReport(node, uri, failure)
    except (PiprosError, ValueError) as problem:
        return ServiceReport(node, uri, failure_of(problem))
    return ServiceReport(node, uri)


def _ask_plugin(master: MasterClient, node: str, check: PluginCheck, timeout_s: float) -> PluginReply:
    try:
        reply = _trigger(master, f"{node}/{check.service}", timeout_s)
    except PiprosError as problem:
        return PluginReply(check, failure=str(problem))
    return PluginReply(check, bool(reply.success), str(reply.message))


def _ask_manager(master: MasterClient, service: str, timeout_s: float) -> list[str]:
    try:
        return str(_trigger(master, service, timeout_s).message).splitlines()[:_NODELETS]
    except PiprosError:  # the check of services reports this
        return []


def _trigger(master: MasterClient, service: str, timeout_s: float) -> Any:
    service_class: Any = load_service_class("std_srvs/Trigger")
    client = ServiceClient(service, service_class, master=lambda: master, calls=OpenCalls())
    try:
        return client.call(service_class._request_class(), timeout_s)
    finally:
        client.close()

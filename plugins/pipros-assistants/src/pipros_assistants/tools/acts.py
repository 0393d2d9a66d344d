"""Tools that act, offered only if the policy has rules for them; see `pipros_server.approved_acts`."""

from __future__ import annotations

import os
import secrets
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Final

from pydantic import Field

from pipros.msg import load_message_class, load_service_class
from pipros_assistants.answer import Answer, ToolRefused
from pipros_assistants.robot import RobotAccess
from pipros_assistants.tools.arguments import Cursor, Name
from pipros_assistants.tools.packages import launch_file
from pipros_assistants.values import shown, whole
from pipros_libraries.actions.status import Status
from pipros_server.approved_acts import CONNECTING_S, ApprovedActs, Caller, System
from pipros_server.policy.decisions import Act
from pipros_server.policy.model import ActKind, Policy
from pipros_tools.graph.message_from_yaml import message_from_yaml
from pipros_tools.graph.service_call import ServiceCaller
from pipros_tools.graph.system_state import SystemState

ASSISTANT_RECORD_BYTES = 1024 * 1024 * 1024
"""Limit: size of a recording. Beyond it, the recording ends."""

CALL_S: Final = 10.0
"""Time limit of a service call."""

Values = Annotated[
    dict[str, Any], Field(max_length=100, description="fields by name; all other fields are zero or empty")
]
Seconds = Annotated[float, Field(ge=0.0, le=10.0)]
Value = Annotated[bool | int | float | Annotated[str, Field(max_length=1000)], Field(union_mode="smart")]
Run = Annotated[int, Field(ge=1, le=10**9, description="field run in the answer of start_launch or record")]


class ActReports:
    """The tools that read what the policy allows, and what acts have started. They change nothing."""

    def __init__(self, acts: ApprovedActs) -> None:
        self._acts = acts

    def read_policy(self, cursor: Cursor = 0) -> Answer:
        """Show the user's policy, a YAML file, line by line. It says what the tools that act may do, with
        which values and how often, and how the robot is stopped. Everything else is refused."""
        return Answer(self._acts.policy.text.splitlines())

    def list_runs(self, cursor: Cursor = 0) -> Answer:
        """List the launch files and recordings that were started here, with the end of their output."""
        return Answer(self._acts.runs.rows())


class ActTools(ActReports):
    """The tools that act, and those that report on them, bound to the client of one call."""

    def __init__(self, acts: ApprovedActs, robot: RobotAccess, bags: Path | None, caller: Caller) -> None:
        super().__init__(acts)
        self._robot = robot
        self._bags = bags
        self._caller = caller

    def publish(
        self,
        topic: Name,
        message: Values,
        seconds: Seconds = 0.0,
        rate_hz: Annotated[float, Field(ge=1.0, le=50.0)] = 10.0,
    ) -> Answer:
        """Publish a message once; or publish it repeatedly for `seconds`, followed by the policy's stop, if
        the topic has one. A human must approve this, unless the message is the stop."""
        name = self._acts.system().node.resolve(topic)
        rule = self._acts.rule(ActKind.TOPIC, name)
        value = message_from_yaml(rule.message_class, message, time.time_ns())
        act = Act(ActKind.TOPIC, name, value, value._type, value._md5sum)

        def carry_out(system: System) -> Answer:
            publisher = self._publisher(system, name)
            sent, end_s = 0, time.monotonic() + seconds
            try:
                while not sent or (time.monotonic() < end_s and not self._caller.over.is_set()):
                    publisher.publish(value)
                    sent += 1
                    if seconds:
                        self._caller.over.wait(1.0 / rate_hz)
            finally:
                if seconds and rule.stop is not None:
                    publisher.publish(rule.stop)
            return Answer([], figures={"messages": sent, "subscribers": publisher.connection_count})

        planned = {"message": whole(value), "seconds": seconds, "rate_hz": rate_hz}
        return self._perform("publish", act, planned if seconds else planned["message"], carry_out)

    def call_service(self, service: Name, request: Values, cursor: Cursor = 0) -> Answer:
        """Call a service, and show its response. A human must approve this, unless the request is the
        policy's stop."""
        name = self._acts.system().node.resolve(service)
        found: Any = load_service_class(self._acts.rule(ActKind.SERVICE, name).type)
        value = message_from_yaml(found._request_class, request, time.time_ns())

        def carry_out(system: System) -> Answer:
            caller = ServiceCaller(system.node.master, name, found)
            with system.gate.calling(name, value, found._type, found._md5sum):
                return Answer([shown(caller.call(value, CALL_S))])

        act = Act(ActKind.SERVICE, name, value, found._type, found._md5sum)
        return self._perform("call_service", act, whole(value), carry_out)

    def set_parameter(self, name: Name, value: Value) -> Answer:
        """Set a parameter. A human must approve this."""
        full = self._acts.system().node.resolve(name)

        def carry_out(system: System) -> Answer:
            system.gate.check_parameter(full, value)
            system.node.params.set(full, value)
            return Answer([])

        return self._perform("set_parameter", Act(ActKind.PARAMETER, full, value), value, carry_out)

    def send_goal(self, action: Name, goal: Values, wait_s: Seconds = 5.0) -> Answer:
        """Send a goal to an action server, and wait up to `wait_s` seconds for its result. data contains the
        goal's id, for cancel_goal, and the result if it arrived in time. A human must approve this."""
        name = self._acts.system().node.resolve(action)
        rule = self._acts.rule(ActKind.TOPIC, f"{name}/goal")
        identity = f"pipros_mcp-{secrets.token_hex(8)}"
        fields = {"header": "auto", "goal_id": {"stamp": "now", "id": identity}, "goal": goal}
        value: Any = message_from_yaml(rule.message_class, fields, time.time_ns())
        result_class: Any = load_message_class(f"{self._acts.policy.actions.get(name, '')}Result")
        act = Act(ActKind.TOPIC, f"{name}/goal", value, value._type, value._md5sum)

        def carry_out(system: System) -> Answer:
            results: list[Any] = []
            has_ended = threading.Event()

            def receive(message: Any) -> None:
                if message.status.goal_id.id == identity:
                    results.append(message)
                    has_ended.set()

            subscriber = system.node.subscribe(f"{name}/result", result_class, receive)
            try:
                publisher = self._publisher(system, f"{name}/goal")
                if not publisher.connection_count:
                    raise ToolRefused(
                        "no action server is connected; list_actions lists the running servers", name
                    )
                self._acts.note_goal(identity, name)
                publisher.publish(value)
                end_s = time.monotonic() + wait_s
                while not (has_ended.is_set() or self._caller.over.is_set()) and time.monotonic() < end_s:
                    has_ended.wait(0.1)
            finally:
                subscriber.unregister()
            rows: list[Any] = [{"goal_id": identity}]
            if not results:
                return Answer(rows, "The goal has not ended yet; read_topic shows the action's status topic.")
            status = Status(results[0].status.status).name.lower()
            return Answer([*rows, {"status": status, "result": shown(results[0].result)}])

        return self._perform("send_goal", act, whole(value.goal), carry_out)

    def cancel_goal(self, goal_id: Name) -> Answer:
        """Cancel a goal that was sent with send_goal."""
        name = self._acts.goals.get(goal_id)
        if name is None:
            raise ToolRefused("send_goal has not sent a goal with this id", goal_id)
        value: Any = load_message_class("actionlib_msgs/GoalID")(id=goal_id)
        act = Act(ActKind.TOPIC, f"{name}/cancel", value, value._type, value._md5sum)

        def carry_out(system: System) -> Answer:
            self._publisher(system, act.name).publish(value)
            return Answer([])

        return self._perform("cancel_goal", act, whole(value), carry_out, needs_human=False)

    def start_launch(
        self,
        package: Name,
        file: Name,
        arguments: Annotated[dict[str, Value], Field(max_length=50)] = {},  # noqa: B006
    ) -> Answer:
        """Start the nodes of a launch file. They run until stop_run or the policy's time limit. file is a
        name from list_launch_files. A human must approve this."""
        name = f"{package}/{file}"
        self._acts.rule(ActKind.LAUNCH, name)
        path = launch_file(self._robot, package, file)
        words = [
            f"{key}:={str(each).lower() if isinstance(each, bool) else each}"
            for key, each in arguments.items()
        ]

        def carry_out(system: System) -> Answer:
            rule = system.gate.check_run(ActKind.LAUNCH, name, arguments)
            return self._start(name, "roslaunch", [str(path), *words], rule.time_limit_s or 0.0)

        return self._perform("start_launch", Act(ActKind.LAUNCH, name, arguments), arguments, carry_out)

    def record(
        self,
        topics: Annotated[list[Name], Field(min_length=1, max_length=50)],
        seconds: Annotated[float, Field(ge=1.0, le=3600.0)],
    ) -> Answer:
        """Record topics into a new bag in the folder that the user allowed, for `seconds` or until stop_run.
        A human must approve this."""
        node = self._acts.system().node
        acts = [Act(ActKind.RECORD, node.resolve(each), {}) for each in topics]
        folder = self._bags
        if folder is None:
            raise ToolRefused("the user has not allowed a folder: pipros mcp --bags FOLDER")
        bag = f"assistant-{time.strftime('%Y-%m-%d-%H-%M-%S')}-{secrets.token_hex(2)}.bag"

        def carry_out(system: System) -> Answer:
            rules = [system.gate.check_run(each.kind, each.name, {}) for each in acts]
            limit_s = min([seconds, *(rule.time_limit_s or 0.0 for rule in rules)])
            megabytes = max(ASSISTANT_RECORD_BYTES >> 20, 1)
            words = ["record", "-O", str(folder / bag), f"--size={megabytes}", *(each.name for each in acts)]
            return self._start(bag, "rosbag", words, limit_s)

        return self._acts.perform(self._caller, "record", acts, {"seconds": seconds, "bag": bag}, carry_out)

    def stop_run(self, run: Run) -> Answer:
        """Stop a launch file or a recording that was started here, and wait a few seconds for its end."""
        has_ended = self._acts.end_run(run)
        if has_ended is None:
            raise ToolRefused("this run does not exist; list_runs lists all runs", run)
        return Answer([], figures={"has_ended": has_ended})

    # -- shared by these tools ------------------------------------------------------------

    def _perform(
        self,
        tool: str,
        act: Act,
        values: Any,
        carry_out: Callable[[System], Answer],
        *,
        needs_human: bool = True,
    ) -> Answer:
        return self._acts.perform(self._caller, tool, [act], values, carry_out, needs_human=needs_human)

    def _publisher(self, system: System, topic: str) -> Any:
        """Return a publisher for a topic. Wait up to `CONNECTING_S` for subscribers known to the master."""
        publisher = system.publishers.get(topic)
        if publisher is None:
            rule = self._acts.policy.rules[ActKind.TOPIC, topic]
            publisher = system.publishers[topic] = system.gate.advertise(topic, rule.message_class)
        end_s = time.monotonic() + CONNECTING_S
        state = SystemState.from_state(system.node.master.get_system_state())
        wanted = len(state.subscribers.get(topic, ()))
        while publisher.connection_count < wanted and time.monotonic() < end_s:
            time.sleep(0.02)
        return publisher

    def _start(self, name: str, program: str, words: list[str], limit_s: float) -> Answer:
        """Start a pipros program in the environment of `ApprovedActs`."""
        code = f"import sys; from pipros_tools.cli.{program} import main; sys.exit(main(sys.argv[1:]))"
        variables = self._acts.environment.applied_to(os.environ)
        command = [sys.executable, "-I", "-c", code, *words]
        return Answer(
            [{"name": name}], figures={"run": self._acts.runs.start(name, command, limit_s, variables)}
        )


def names_of_tools(policy: Policy) -> Iterator[str]:
    """Yield the names of the tools that a policy needs: `read_policy`, and the tools for its rules."""
    actions = {f"{action}/{part}" for action in policy.actions for part in ("goal", "cancel")}
    kinds = {kind for kind, name in policy.rules if kind is not ActKind.TOPIC or name not in actions}
    of_kind: Mapping[ActKind, tuple[str, ...]] = {
        ActKind.TOPIC: ("publish",),
        ActKind.SERVICE: ("call_service",),
        ActKind.PARAMETER: ("set_parameter",),
        ActKind.LAUNCH: ("start_launch", "list_runs", "stop_run"),
        ActKind.RECORD: ("record", "list_runs", "stop_run"),
    }
    found = ["read_policy", *(("send_goal", "cancel_goal") if policy.actions else ())]
    yield from dict.fromkeys([*found, *(name for kind in of_kind if kind in kinds for name in of_kind[kind])])

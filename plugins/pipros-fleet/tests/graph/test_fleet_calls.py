"""Services and parameters between the members of a fleet, and what their files forbid."""

import json
import threading
from contextlib import closing
from typing import Any

import pytest

from pipros.msg import load_service_class
from pipros.node.open_calls import OpenCalls
from pipros.node.service_client import ServiceClient
from pipros.node.service_link import ErrorReply, ServiceFailed
from pipros_fleet import keys
from pipros_fleet.zenoh_session import LinkFailed
from tests.support.fleet import LIMIT_S, Member
from tests.support.waiting import wait_until

SetBool: Any = load_service_class("std_srvs/SetBool")
Trigger: Any = load_service_class("std_srvs/Trigger")
FILE = """
share: {parameters: [{name: /public/*, from: [operator]}]}
accept:
  services: [{name: /lamp, from: [operator], timeout_s: 60}, /slow]
  parameters: [{name: /public/speed, from: [operator]}]
"""


def call(member: Member, service: str, request: Any, service_class: Any = SetBool) -> Any:
    node = member.agent_node
    with closing(
        ServiceClient(service, service_class, master=lambda: node.master, calls=OpenCalls())
    ) as client:
        return client.call(request, LIMIT_S)


def ask(member: Member, other: str, verb: str, value: Any, caller: str | None = None) -> Any:
    key = keys.parameters(other, verb, caller or member.name)
    (answer,) = member.link.get(key, b"" if value is None else json.dumps(value).encode(), timeout_s=LIMIT_S)
    return json.loads(answer.payload)


def test_services_of_a_member_are_called_below_its_name(router: str) -> None:
    with Member("robot1", router, FILE) as robot, Member("operator", router) as operator:

        def switch(request: Any) -> Any:
            if not request.data:
                raise ValueError("the lamp is broken")
            return SetBool._response_class(True, "on")

        robot.node("lamp").serve("/lamp", SetBool, switch)
        robot.node("secret").serve("/secret", Trigger, lambda _: Trigger._response_class())
        operator.wait_for_service("/robot1/lamp")
        assert call(operator, "/robot1/lamp", SetBool._request_class(True)).message == "on"
        with pytest.raises(ErrorReply, match="the lamp is broken"):
            call(operator, "/robot1/lamp", SetBool._request_class(False))
        assert "/robot1/secret" not in operator.state().services
        with pytest.raises(ServiceFailed, match="md5sum"):
            call(operator, "/robot1/lamp", Trigger._request_class(), Trigger)

        with pytest.raises(LinkFailed, match=r"\[operator\] is not allowed to call \[/secret\]"):
            operator.link.get(keys.service("robot1", "operator", "/secret"), timeout_s=LIMIT_S)
        with pytest.raises(LinkFailed, match=r"\[stranger\] is not allowed to call \[/lamp\]"):
            operator.link.get(keys.service("robot1", "stranger", "/lamp"), timeout_s=LIMIT_S)


def test_a_service_that_takes_too_long_fails(router: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipros_fleet.calls.GRACE_S", 60.0)  # the reason comes from the other member
    is_over = threading.Event()
    file = FILE.replace("timeout_s: 60", "timeout_s: 0.5")
    with Member("robot1", router, file) as robot, Member("operator", router) as operator:

        def wait(_: Any) -> Any:
            is_over.wait(LIMIT_S)
            return SetBool._response_class()

        robot.node("lamp").serve("/lamp", SetBool, wait)
        operator.wait_for_service("/robot1/lamp")
        try:
            with pytest.raises(ErrorReply, match="did not answer in time"):
                call(operator, "/robot1/lamp", SetBool._request_class(True))
        finally:
            is_over.set()


def test_a_call_fails_when_the_member_leaves(router: str) -> None:
    is_called, is_over = threading.Event(), threading.Event()
    errors: list[Exception] = []
    with Member("operator", router) as operator:
        with Member("robot1", router, FILE) as robot:

            def wait(_: Any) -> Any:
                is_called.set()
                is_over.wait(LIMIT_S)
                return SetBool._response_class()

            robot.node("slow").serve("/slow", SetBool, wait)
            operator.wait_for_service("/robot1/slow")

            def make_call() -> None:
                try:
                    call(operator, "/robot1/slow", SetBool._request_class(True))
                except ServiceFailed as error:
                    errors.append(error)

            caller = threading.Thread(target=make_call)
            caller.start()
            assert is_called.wait(LIMIT_S)
            robot.link.close()
            caller.join(LIMIT_S)
            is_over.set()
        assert len(errors) == 1


def test_parameters_are_read_and_set_as_the_file_allows(router: str) -> None:
    with Member("robot1", router, FILE) as robot, Member("operator", router) as operator:
        master = robot.agent_node.master
        for name, value in (("/public/speed", 1.5), ("/public/tree", {"a": [1, "x"]}), ("/secret", 1)):
            master.set_param(name, value)
        wait_until(lambda: "robot1" in operator.agent.statistics()["members"], LIMIT_S, "the member")
        assert ask(operator, "robot1", "get", None) == ["/public/speed"]
        assert ask(operator, "robot1", "get", "/public/speed") == 1.5
        assert ask(operator, "robot1", "get", "/public/tree") == {"a": [1, "x"]}
        assert ask(operator, "robot1", "set", ["/public/speed", 2.5]) is True
        assert master.get_param("/public/speed") == 2.5
        for verb, value, reason in (
            ("get", "/secret", r"\[/secret\] is not shared with \[operator\]"),
            ("get", "/public/none", r"\[/public/none\] is not set"),
            ("get", 5, "must have a global name"),
            ("set", ["/public/tree", 1], r"\[operator\] is not allowed to set parameter \[/public/tree\]"),
            ("set", "nonsense", "must be \\[name, value\\]"),
        ):
            with pytest.raises(LinkFailed, match=reason):
                ask(operator, "robot1", verb, value)
        with pytest.raises(LinkFailed, match="not allowed to set"):
            ask(operator, "robot1", "set", ["/public/speed", 0], caller="stranger")
        assert not operator.agent_node.master.has_param("/robot1"), "trees are never merged"


def test_denied_parameters_are_not_reached_by_other_names(router: str) -> None:
    denied = "[{name: /secret/**, allow: false}, {name: /limit, allow: false}, /**]"
    file = f"share: {{parameters: {denied}}}\naccept: {{parameters: {denied}}}\n"
    with Member("robot1", router, file) as robot, Member("operator", router) as operator:
        master = robot.agent_node.master
        for name in ("/secret/key", "/limit", "/public/a", "/public/b/c"):
            master.set_param(name, 1)
        before = master.get_param("/secret"), master.get_param("/limit")
        wait_until(lambda: "robot1" in operator.agent.statistics()["members"], LIMIT_S, "the member")
        for name in ("//secret/key", "/secret//key/", "secret/key", "/./secret", "/secret/key/"):
            with pytest.raises(LinkFailed):
                ask(operator, "robot1", "get", name)
        assert ask(operator, "robot1", "get", "/secret") == {}
        everything = ask(operator, "robot1", "get", "/")
        assert "secret" not in everything
        assert "limit" not in everything
        assert everything["public"] == {"a": 1, "b": {"c": 1}}
        for name, value in (
            ("//secret/key", 2), ("/secret", {"key": 2}), ("/secret", 2), ("/secret", {}),
            ("/", {"secret": {"key": 2}}), ("/", {"secret/key": 2}), ("/", {}), ("/limit/", 2),
            ("/limit/a", 2),
        ):  # fmt: skip
            with pytest.raises(LinkFailed, match="is not allowed to"):
                ask(operator, "robot1", "set", [name, value])
        deep: Any = 1
        for _ in range(900):
            deep = {"a": deep}
        with pytest.raises(LinkFailed):
            ask(operator, "robot1", "set", ["/public", deep])
        assert (master.get_param("/secret"), master.get_param("/limit")) == before
        assert ask(operator, "robot1", "set", ["/public", {"b": 2}]) is True
        assert master.get_param("/public") == {"b": 2}

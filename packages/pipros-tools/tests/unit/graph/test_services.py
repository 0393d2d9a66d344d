"""Looking up services at their servers."""

import socket
import time
from contextlib import suppress
from typing import Any, cast

import pytest

from pipros.msg import load_service_class
from pipros.net.master_client import MasterClient
from pipros_tools.graph import services
from pipros_tools.graph.errors import GraphError
from pipros_tools.graph.service_call import ServiceCaller, wait_for_service
from tests.support.table_master import TableMaster


def test_a_silent_address_is_called_twice_by_each_thread_whatever_is_registered_there(monkeypatch) -> None:
    monkeypatch.setattr(services, "PROBE_DEADLINE_S", 0.1)
    with socket.create_server(("127.0.0.1", 0), backlog=200) as silent:
        silent.setblocking(False)

        class Registrations:
            caller_id = "/test"

            def get_system_state(self) -> Any:
                return [[], [], [[f"/service{number}", ["/silent"]] for number in range(100)]]

            def lookup_service(self, _: str) -> str:
                return f"rosrpc://127.0.0.1:{silent.getsockname()[1]}"

        master = cast(MasterClient, Registrations())
        assert services.services_of_type(master, "std_srvs/Empty") == []
        called = 0
        with suppress(BlockingIOError):
            while True:
                silent.accept()[0].close()
                called += 1
    assert 1 <= called <= 2 * services.ASKED_AT_ONCE


@pytest.mark.parametrize(("took_s", "is_silent"), [(0.09, True), (0.0, False)])
def test_a_timeout_is_recognized_by_a_clock_with_large_steps(took_s: float, is_silent: bool) -> None:
    assert services.was_silent(time.monotonic() - took_s, 0.1) is is_silent


def test_the_services_of_a_server_that_was_busy_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(services, "PROBE_DEADLINE_S", 0.0)  # every error is taken for a timeout
    monkeypatch.setattr(services, "ASKED_AT_ONCE", 1)
    asked: list[str] = []

    def type_of(_: object, service: str) -> str:
        asked.append(service)
        if len(asked) == 1:
            raise GraphError("no answer")
        return "std_srvs/Empty"

    class Registrations:
        def get_system_state(self) -> Any:
            return [[], [], [["/one", ["/busy"]], ["/two", ["/busy"]], ["/three", ["/other"]]]]

        def lookup_service(self, service: str) -> str:
            return "rosrpc://other:1" if service == "/three" else "rosrpc://busy:1"

    monkeypatch.setattr(services, "type_of", type_of)
    master = cast(MasterClient, Registrations())
    assert services.services_of_type(master, "std_srvs/Empty") == ["/one", "/two", "/three"]
    assert asked == ["/one", "/three", "/one", "/two"]


# Service requests from YAML values, and waits for a service, without a server.


MASTER = TableMaster({})


def caller(service_type: str) -> ServiceCaller:
    return ServiceCaller(MASTER, "/service", load_service_class(service_type))


def test_a_service_is_waited_for() -> None:
    master = TableMaster({})
    pauses: list[float] = []

    def pause(seconds: float) -> None:
        pauses.append(seconds)
        if len(pauses) == 3:
            master.answers["lookupService", "/add"] = "rosrpc://robot:1"

    wait_for_service(master, "/add", pause=pause)

    assert len(pauses) == 3


def test_a_request_takes_values_in_order_or_by_name() -> None:
    by_order = caller("std_srvs/SetBool").request([True])
    by_name = caller("std_srvs/SetBool").request([{"data": True}])

    assert by_order == by_name
    assert by_order.data is True


def test_only_requests_with_fields_take_arguments() -> None:
    assert caller("std_srvs/SetBool").takes_arguments
    assert not caller("std_srvs/Empty").takes_arguments


def test_now_is_the_time_of_the_request_and_text_need_not_be_ascii() -> None:
    request = caller("nav_msgs/GetPlan").request([{"start": {"header": {"stamp": "now", "frame_id": "ü"}}}])

    assert request.start.header.stamp.to_sec() > 1e9


@pytest.mark.parametrize("values", [[], [True, False], [{"nope": 1}]])
def test_the_error_about_wrong_service_arguments_lists_the_fields(values: list[object]) -> None:
    with pytest.raises(GraphError) as raised:
        caller("std_srvs/SetBool").request(values)

    assert str(raised.value).startswith("Incompatible arguments to call service:\n")
    assert str(raised.value).endswith("Service arguments are: [data]")


def test_a_value_of_the_wrong_type_shows_the_definition() -> None:
    with pytest.raises(GraphError) as raised:
        caller("std_srvs/SetBool").request(["maybe"])

    assert "  field data is not a bool\n" in str(raised.value)
    assert str(raised.value).endswith("srv file:\nbool data\n---\nbool success\nstring message\n")

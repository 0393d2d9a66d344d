"""Service requests from YAML values, and waits for a service, without a server."""

import pytest

from pipros.msg import load_service_class
from pipros_tools.graph.errors import GraphError
from pipros_tools.graph.service_call import ServiceCaller, wait_for_service
from tests.support.table_master import TableMaster

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

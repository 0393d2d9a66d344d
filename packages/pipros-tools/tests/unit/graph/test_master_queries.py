"""Topics, services, nodes and parameters of a system, from a table of master responses."""

import pytest

from pipros.basics.errors import NotFound, Unreachable
from pipros.net.master_client import MasterClient
from pipros_tools.graph.cleanup import WARNING, clean_up
from pipros_tools.graph.errors import GraphError
from pipros_tools.graph.node_info import describe_registrations
from pipros_tools.graph.nodes import UNKNOWN_API, kill, listing, machines, node_names
from pipros_tools.graph.params import delete, names_below, read, write
from pipros_tools.graph.services import nodes_by_service, service_class_of, uri_of
from pipros_tools.graph.system_state import SystemState, by_node, is_below, of_node
from pipros_tools.graph.topics import describe_topic, field_type, topic_type, topics_of_type
from tests.support.table_master import Answers, TableMaster

STATE = [
    [["/chatter", ["/talker", "/ns/other"]]],
    [["/chatter", ["/listener"]], ["/odd", ["/listener"]]],
    [["/add", ["/talker"]], ["/empty", []]],
]
TYPES = [["/chatter", "std_msgs/String"], ["/chatter/extra", "std_msgs/Int32"], ["/odd", "*"]]
ANSWERS: Answers = {
    ("getSystemState",): STATE, ("getTopicTypes",): TYPES, ("getPublishedTopics", ""): TYPES[:1],
    ("lookupNode", "/talker"): "http://one:1/", ("lookupNode", "/listener"): "http://two:2/",
    ("lookupService", "/add"): "rosrpc://one:3",
}  # fmt: skip


@pytest.fixture
def master() -> TableMaster:
    return TableMaster(ANSWERS)


@pytest.mark.parametrize(("name", "found"), [
    ("/chatter", ("std_msgs/String", "/chatter")), ("/chatter/data", ("std_msgs/String", "/chatter")),
    ("/chatter/extra/data", ("std_msgs/Int32", "/chatter/extra")), ("/odd", (None, "/odd")),
    ("/nothing/here", (None, "/nothing/here")),
])  # fmt: skip
def test_a_field_belongs_to_the_longest_topic(master, name: str, found: tuple[str | None, str]) -> None:
    assert topic_type(master, name) == found


def test_a_topic_is_described_with_the_addresses_of_its_nodes(master: TableMaster) -> None:
    assert describe_topic(master, "/chatter") == (
        "Type: std_msgs/String\n\nPublishers: \n * /talker (http://one:1/)\n * /ns/other (unknown)\n\n"
        "Subscribers: \n * /listener (http://two:2/)\n\n"
    )
    with pytest.raises(GraphError, match="Unknown topic /nothing"):
        describe_topic(master, "/nothing")


def test_topics_are_found_by_their_type(master: TableMaster) -> None:
    assert topics_of_type(master, "std_msgs/String") == ["/chatter"]


def test_nested_fields_have_types() -> None:
    assert field_type("std_msgs/Header", ["stamp", "secs"]) == "int32"
    with pytest.raises(NotFound, match=r"no field \[nope\]"):
        field_type("std_msgs/Header", ["nope"])


def test_nodes_are_listed_by_namespace(master: TableMaster) -> None:
    assert node_names(master) == ["/listener", "/ns/other", "/talker"]
    assert listing(master, "/ns") == ["/ns/other"]
    assert listing(master, "/", uris=True) == ["http://two:2/", UNKNOWN_API, "http://one:1/"]
    assert listing(master, "/talker", both=True) == ["http://one:1/ \t/talker"]


def test_machines_are_the_hosts_of_the_addresses(master: TableMaster) -> None:
    assert machines(master) == ["one", "two"]


def test_an_unknown_node_is_not_killed(master: TableMaster) -> None:
    killed, failed = kill(master, ["/nobody"])

    assert (killed, list(failed)) == ([], ["/nobody"])


def test_the_registrations_of_a_node_are_described(master: TableMaster) -> None:
    assert describe_registrations(master, "/listener") == (
        "Node [/listener]\nPublications: None\n\nSubscriptions: \n * /chatter [std_msgs/String]\n"
        " * /odd [unknown type]\n\nServices: None\n"
    )


def test_services_are_those_with_a_node(master: TableMaster) -> None:
    assert nodes_by_service(master) == {"/add": "/talker"}
    assert (uri_of(master, "/add"), uri_of(master, "/nothing")) == ("rosrpc://one:3", None)
    with pytest.raises(GraphError, match=r"Service \[/nothing\] is not available"):
        service_class_of(master, "/nothing")


def test_a_dictionary_is_written_leaf_by_leaf() -> None:
    master = TableMaster({}, accepts=("setParam",))

    assert write(master, "/a", {"b": 1, "c": {"d": [2]}}) == [("/a/b", 1), ("/a/c/d", [2])]
    assert master.calls == [("setParam", "/a/b", 1), ("setParam", "/a/c/d", [2])]


@pytest.mark.parametrize("value", ["\x01", 1 << 40, object()])
def test_a_value_that_xml_rpc_cannot_represent_is_named(value: object) -> None:
    with pytest.raises(GraphError, match=r"cannot set parameter \[/a/b\] to \["):
        write(MasterClient("http://127.0.0.1:1", "/test"), "/a", {"b": value})


def test_unset_parameters_are_named() -> None:
    nothing = TableMaster({})
    for action in (read, delete):
        with pytest.raises(GraphError, match=r"\[/a\] is not set"):
            action(nothing, "/a")


def test_deleting_the_root_empties_it() -> None:
    master = TableMaster({}, accepts=("setParam",))

    delete(master, "/")

    assert master.calls == [("setParam", "/", {})]


def test_parameters_of_a_namespace_are_sorted() -> None:
    master = TableMaster({("getParamNames",): ["/b/x", "/ab", "/a/y", "/a/b"]})

    assert names_below(master, "/a") == ["/a/b", "/a/y"]


MASTER_STATE = [
    [["/chatter", ["/talker", "/other"]], ["/rosout", ["/talker"]]],
    [["/chatter", ["/listener"]], ["/odd", []]],
    [["/add", ["/server"]]],
]


def test_a_picture_is_read_from_the_masters_answer() -> None:
    state = SystemState.from_state(MASTER_STATE)
    assert state.publishers == {"/chatter": ["/talker", "/other"], "/rosout": ["/talker"]}
    assert state.subscribers == {"/chatter": ["/listener"], "/odd": []}
    assert state.services == {"/add": ["/server"]}


def test_topics_and_nodes_are_sorted_and_named_once() -> None:
    state = SystemState.from_state(MASTER_STATE)
    assert state.topics() == ["/chatter", "/odd", "/rosout"]
    assert state.nodes() == ["/listener", "/other", "/server", "/talker"]


def test_topics_of_a_node_are_found() -> None:
    assert of_node("/talker", SystemState.from_state(MASTER_STATE).publishers) == ["/chatter", "/rosout"]


def test_the_topics_of_all_nodes_are_found_without_a_search_for_each_node() -> None:
    class Unsearched(list[str]):
        def __contains__(self, _: object) -> bool:
            raise AssertionError("each of many topics is searched for each of many nodes")

    publishers = {"/scan": Unsearched(["/b"]), "/chatter": Unsearched(["/a", "/b", "/b"])}
    assert by_node(publishers) == {"/a": ["/chatter"], "/b": ["/chatter", "/scan"]}


@pytest.mark.parametrize(("name", "ns", "is_in"), [
    ("/a/b", "/a", True), ("/a", "/a", True), ("/ab", "/a", False), ("/a/b", "/", True),
    ("/a/b", "/a/", True), ("/a", "/a/b", False),
])  # fmt: skip
def test_namespaces_end_at_a_slash(name: str, ns: str, is_in: bool) -> None:
    assert is_below(name, ns) is is_in


# Unregistering nodes that do not respond: the question to the user, and the removed registrations.


STALE_ANSWERS = {
    ("getSystemState",): [[["/t", ["/good", "/bad"]]], [], []],
    ("lookupNode", "/good"): "http://good:1/",
    ("lookupNode", "/bad"): "http://bad:1/",
}


class Run:
    def __init__(self, *answers: str, dead: str = "bad") -> None:
        self.lines: list[str] = []
        self.removed: list[str] = []

        def ask(api: str, _caller_id: str) -> object:
            if dead in api:
                raise Unreachable(api, "no response in time")
            return 1

        clean_up(
            TableMaster(STALE_ANSWERS), say=self.lines.append, complain=lambda _: None, answers=answers,
            ask=ask, remove=lambda _, node: self.removed.append(node),
        )  # fmt: skip


def test_after_a_y_the_silent_nodes_are_removed() -> None:
    run = Run("y\n")

    assert run.removed == ["/bad"]
    assert run.lines == [
        "Unable to contact the following nodes:\n * /bad", WARNING, "Unregistering /bad", "done",
    ]  # fmt: skip


def test_invalid_answers_are_asked_again() -> None:
    assert Run("yes\n", "\n", "y\n").removed == ["/bad"]


@pytest.mark.parametrize("answers", [("n\n",), ("maybe\n", "n\n"), ()])
def test_no_and_the_end_of_input_remove_nothing(answers: tuple[str, ...]) -> None:
    run = Run(*answers)

    assert (run.removed, run.lines[-1]) == ([], "aborting")


def test_without_dead_nodes_there_is_no_question() -> None:
    run = Run(dead="nobody")

    assert run.lines == []

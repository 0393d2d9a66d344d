"""Python modules of the command-line tools: rosmsg, rosnode, rosparam, rosservice, rostopic."""

import os
from pathlib import Path
from xmlrpc.client import DateTime

import pytest
from geometry_msgs.msg import PointStamped
from std_msgs.msg import String
from std_srvs.srv import SetBool

import rosgraph
import rosmsg
import rosnode
import rosparam
import rosservice
import rostopic
from pipros.master.master import Master
from tests.support.nodes import MakeNode


@pytest.fixture(autouse=True)
def environment(master: Master, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", master.uri)


def test_rosnode_lists_and_pings_nodes(make_node: MakeNode) -> None:
    node = make_node("talker")
    node.advertise("/chatter", String)
    assert (rosnode.get_node_names(), rosnode.get_node_names("/elsewhere")) == (["/talker"], [])
    assert rosnode.get_api_uri(None, "/talker") == node.uri
    assert rosnode.get_machines_by_nodes() == ["127.0.0.1"]
    assert rosnode.get_nodes_by_machine("localhost") == ["/talker"]
    assert rosnode.rosnode_ping("/talker", max_count=1)
    assert rosnode.rosnode_ping_all() == (["/talker"], [])
    assert "* /chatter [std_msgs/String]" in rosnode.get_node_info_description("/talker")
    assert "Pid:" in rosnode.get_node_connection_info_description(node.uri, None)


def test_rosnode_ends_nodes(make_node: MakeNode) -> None:
    node = make_node("talker")
    node.advertise("/chatter", String)
    assert rosnode.kill_nodes(["/talker", "/nobody"]) == (["/talker"], ["/nobody"])
    assert node.wait_for_shutdown(timeout_s=60)


def test_pinging_an_unknown_node_is_false(capsys: pytest.CaptureFixture[str]) -> None:
    assert not rosnode.rosnode_ping("/nobody", max_count=1)
    assert capsys.readouterr().err == "cannot ping [/nobody]: unknown node\n"


def test_without_a_master_each_has_its_own_exception(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
    with pytest.raises(rosnode.ROSNodeIOException, match="Unable to communicate with master!"):
        rosnode.get_node_names()
    with pytest.raises(rosparam.RosParamIOException, match="Unable to communicate with master!"):
        rosparam.list_params("/")
    with pytest.raises(rosservice.ROSServiceIOException, match="Unable to communicate with master!"):
        rosservice.get_service_list()
    with pytest.raises(rostopic.ROSTopicIOException, match="Unable to communicate with master!"):
        rostopic.get_topic_type("/chatter")


def test_rostopic_yields_the_documents_of_a_pipe_as_they_arrive(monkeypatch: pytest.MonkeyPatch) -> None:
    reader, writer = os.pipe()
    with open(reader) as stdin, open(writer, "w") as pipe:
        monkeypatch.setattr("sys.stdin", stdin)
        documents = rostopic.stdin_yaml_arg()
        print("data: 1\n---", file=pipe, flush=True)
        assert next(documents) == [{"data": 1}]
        print("data: 2", file=pipe, flush=True)
        pipe.close()
        assert list(documents) == [[{"data": 2}]]


def test_rostopic_knows_types_and_classes(make_node: MakeNode) -> None:
    make_node("talker").advertise("/point", PointStamped)
    assert rostopic.get_topic_type("/point") == ("geometry_msgs/PointStamped", "/point", None)
    assert rostopic.get_topic_type("/nothing") == (None, None, None)
    message_class, topic, take = rostopic.get_topic_class("/point/point/x", blocking=True)
    assert (message_class, topic) == (PointStamped, "/point")
    assert take is not None
    message = PointStamped()
    message.point.x = 2.5
    assert take(message) == 2.5
    assert rostopic.get_topic_list() == ([("/point", "geometry_msgs/PointStamped", ["/talker"])], [])
    assert rostopic.find_by_type("geometry_msgs/PointStamped") == ["/point"]
    assert rostopic.get_info_text("/point").startswith("Type: geometry_msgs/PointStamped\n")
    with pytest.raises(rostopic.ROSTopicException, match="Unknown topic /nothing"):
        rostopic.get_info_text("/nothing")


def test_rates_are_measured_from_callbacks() -> None:
    hz = rostopic.ROSTopicHz(-1, use_wtime=True)
    assert hz.get_hz("/chatter") is None
    for _ in range(3):
        hz.callback_hz(String("x"), "/chatter")
    found = hz.get_hz("/chatter")
    assert found[4] == 3
    assert hz.get_hz("/chatter") is None  # nothing new since


def test_rosparam_loads_files_and_keeps_neighbours(tmp_path: Path) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text("wheels: {left: 1}\nangle: deg(180)\n")
    rosparam.set_param("/robot/wheels/right", "2")
    for values, ns in rosparam.load_file(str(file), default_namespace="/robot"):
        rosparam.upload_params(ns, values)
    assert rosparam.get_param("/robot") == {
        "wheels": {"left": 1, "right": 2}, "angle": pytest.approx(3.14159265),
    }  # fmt: skip
    assert rosparam.list_params("/robot/wheels") == ["/robot/wheels/left", "/robot/wheels/right"]
    rosparam.delete_param("/robot/wheels")
    assert list(rosparam.get_param("/robot")) == ["angle"]
    rosparam.dump_params(str(tmp_path / "out.yaml"), "/robot")
    assert (tmp_path / "out.yaml").read_text().startswith("angle: 3.14159")
    with pytest.raises(rosgraph.MasterError, match=r"Parameter \[/robot/wheels\] is not set"):
        rosparam.get_param("/robot/wheels")


def test_rosparam_keeps_binary_values_and_odd_texts(tmp_path: Path) -> None:
    rosparam.set_param_raw("/binary", b"\x00\xff")
    rosparam.set_param_raw("/text", "grüß\nzweimal")
    assert rosparam.get_param("/") == {"binary": b"\x00\xff", "text": "grüß\nzweimal"}
    rosparam.dump_params(str(tmp_path / "all.yaml"), "/")
    assert rosparam.load_file(str(tmp_path / "all.yaml"), "/") == [(rosparam.get_param("/"), "/")]


def test_rosservice_finds_and_calls(make_node: MakeNode) -> None:
    def handle(request: object) -> object:
        return SetBool._response_class(request.data, "done")

    make_node("server").serve("/set", SetBool, handle)
    assert rosservice.get_service_list() == ["/set"]
    assert rosservice.get_service_list(include_nodes=True) == [["/set", ["/server"]]]
    assert rosservice.get_service_node("/set") == "/server"
    assert rosservice.get_service_type("/set") == "std_srvs/SetBool"
    assert rosservice.get_service_type("/nothing") is None
    assert rosservice.get_service_class_by_name("/set") is SetBool
    assert rosservice.get_service_args("/set") == "data"
    assert rosservice.rosservice_find("std_srvs/SetBool") == ["/set"]
    for values in ({"data": True}, [{"data": True}], [True]):
        request, response = rosservice.call_service("/set", values)
        assert (request.data, response.success, response.message) == (True, True, "done")
    with pytest.raises(rosservice.ROSServiceIOException, match=r"Service \[/nothing\] is not available"):
        rosservice.call_service("/nothing", [])


def test_rosmsg_shows_and_lists_types() -> None:
    assert rosmsg.get_msg_text("std_msgs/String") == "string data\n"
    assert rosmsg.get_srv_text("std_srvs/SetBool") == "bool data\n---\nbool success\nstring message\n"
    assert rosmsg.list_srvs("std_srvs") == ["std_srvs/Empty", "std_srvs/SetBool", "std_srvs/Trigger"]
    assert "std_msgs/String" in rosmsg.list_msgs("std_msgs")
    assert list(rosmsg.rosmsg_search(None, rosmsg.MODE_MSG, "PointStamped")) == ["geometry_msgs/PointStamped"]
    assert rosmsg.rosmsg_md5(rosmsg.MODE_MSG, "std_msgs/String") == String._md5sum
    assert "std_srvs" in dict(rosmsg.iterate_packages(None, rosmsg.MODE_SRV))
    with pytest.raises(rosmsg.ROSMsgException, match="nowhere_msgs"):
        rosmsg.get_msg_text("nowhere_msgs/Nothing")
    with pytest.raises(rosmsg.ROSMsgException, match="nowhere_msgs"):
        rosmsg.list_msgs("nowhere_msgs")


def test_a_file_that_is_not_utf8_is_a_plain_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "image.png"
    file.write_bytes(b"\x89PNG\xff\xfe")
    with pytest.raises(SystemExit) as end:
        rosparam.yamlmain(["rosparam", "set", "-t", str(file), "/image"])
    assert end.value.code == 1
    assert "is not UTF-8 text" in capsys.readouterr().err
    rosparam.yamlmain(["rosparam", "set", "-b", str(file), "/image"])
    assert rosparam.get_param("/image") == b"\x89PNG\xff\xfe"


def test_dates_of_other_clients_can_be_read() -> None:
    rosparam.get_param_server().setParam("/date", DateTime("20260102T03:04:05"))
    assert rosparam.get_param("/date") == "20260102T03:04:05"

"""The ROS 2 names in DDS and Zenoh."""

from __future__ import annotations

import pytest

from pipros.basics.errors import InvalidName
from pipros_rosbag2 import names

STRING = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"


def test_topics_and_services_have_prefixes() -> None:
    assert names.dds_topic("/a/b") == "rt/a/b"
    assert names.dds_service("/add") == names.ServiceTopics("rq/addRequest", "rr/addReply")
    assert names.topic_of_dds("rt/a/b") == "/a/b"
    assert names.topic_of_dds("ros_discovery_info") is None
    assert names.service_of_dds("rq/addRequest") == names.service_of_dds("rr/addReply") == "/add"
    assert names.service_of_dds("rq/addReply") is None


def test_actions_are_services_and_topics() -> None:
    found = names.action_names("/turn")

    assert names.dds_service(found.send_goal).request == "rq/turn/_action/send_goalRequest"
    assert names.dds_topic(found.feedback) == "rt/turn/_action/feedback"


@pytest.mark.parametrize(("name", "in_dds"), [
    ("std_msgs/msg/String", "std_msgs::msg::dds_::String_"),
    ("std_srvs/srv/SetBool_Request", "std_srvs::srv::dds_::SetBool_Request_"),
    ("a/action/Turn_SendGoal_Request", "a::action::dds_::Turn_SendGoal_Request_"),
])  # fmt: skip
def test_types_have_a_form_in_dds(name: str, in_dds: str) -> None:
    assert (names.dds_type(name), names.type_of_dds(in_dds)) == (in_dds, name)


def test_other_types_are_not_of_ros2() -> None:
    assert names.type_of_dds("HelloWorld") is None


def test_keys_equal_the_published_ones() -> None:
    assert names.zenoh_key(0, "/chatter", "std_msgs/msg/String", STRING) == (
        f"0/chatter/std_msgs::msg::dds_::String_/{STRING}"
    )


@pytest.mark.parametrize("name", ["chatter", "/", "/a/", "/9a", "/a//b", "/a__b", "/a-b", "", "/é"])
def test_names_that_ros2_refuses_raise(name: str) -> None:
    with pytest.raises(InvalidName, match="is not a full ROS 2 name"):
        names.dds_topic(name)


def test_a_name_has_a_maximum_length_in_dds() -> None:
    assert len(names.dds_topic("/" + "a" * 252)) == 255
    with pytest.raises(InvalidName, match="more than 255 characters"):
        names.dds_topic("/" + "a" * 253)

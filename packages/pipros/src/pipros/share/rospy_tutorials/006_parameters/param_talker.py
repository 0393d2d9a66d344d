#!/usr/bin/env python3
"""Reads, sets, deletes and searches for parameters, then publishes the parameter `utterance` repeatedly."""

from std_msgs.msg import String

import rospy


def log(name: str, value: object) -> None:
    rospy.loginfo("%s is %s", rospy.resolve_name(name), value)


def talk() -> None:
    rospy.init_node("param_talker")
    log("/global_example", rospy.get_param("/global_example"))
    utterance = rospy.get_param("utterance")
    log("utterance", utterance)
    topic = rospy.get_param("~topic_name")
    log("~topic_name", topic)
    log("default_param", rospy.get_param("default_param", "default_value"))
    gains = rospy.get_param("gains")
    rospy.loginfo("gains are %s, %s, %s", gains["P"], gains["I"], gains["D"])

    rospy.loginfo("setting parameters...")
    rospy.set_param("list_of_floats", [1.0, 2.0, 3.0, 4.0])
    rospy.set_param("bool_True", True)
    rospy.set_param("~private_bar", 1 + 2)
    rospy.set_param("to_delete", "baz")
    rospy.loginfo("...parameters have been set")

    if rospy.has_param("to_delete"):
        rospy.delete_param("to_delete")
        rospy.loginfo("deleted %s parameter", rospy.resolve_name("to_delete"))
    found = rospy.search_param("global_example")
    rospy.loginfo("found global_example parameter under key: %s", found)

    publisher = rospy.Publisher(topic, String, queue_size=10)
    rate = rospy.Rate(1)
    while not rospy.is_shutdown():
        publisher.publish(utterance)
        rospy.loginfo(utterance)
        rate.sleep()


if __name__ == "__main__":
    try:
        talk()
    except rospy.ROSInterruptException:
        pass

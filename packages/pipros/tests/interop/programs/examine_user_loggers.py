"""Log from functions and methods, with loggers of the program's own class and with rospy's."""

import io
import logging
import os
import sys

from examination import begin, examine

import rosgraph.roslogging


class UserLogger(logging.Logger):
    def findCaller(self, *args, **kwargs):  # noqa: N802
        return "<file>", 7, "<function>", None


os.environ["ROSCONSOLE_FORMAT"] = "${severity} ${message} ${logger} ${line} ${function}"
if "own" in sys.argv:
    logging.setLoggerClass(UserLogger)
rosgraph.roslogging.configure_logging("program", logging.INFO)
rosout = logging.getLogger("rosout")
begin("configured")
examine("class", lambda: type(rosout).__name__)
examine("handlers", lambda: [type(handler).__name__ for handler in rosout.handlers])
examine("level", lambda: (rosout.level, bool(rosout.propagate)))
examine("new", lambda: type(logging.getLogger("new")).__name__)
out, err = io.StringIO(), io.StringIO()
rosout.removeHandler(rosout.handlers[0])
rosout.addHandler(rosgraph.roslogging.RosStreamHandler(colorize=False, stdout=out, stderr=err))

import rospy  # noqa: E402


class Base:
    def method(self):
        rospy.loginfo("%s", "method")
        rospy.logwarn("warned")
        rospy.logerr_once("once")
        rospy.loginfo("named", logger_name="sub")
        (lambda: rospy.loginfo("lambda"))()

    @classmethod
    def of_class(cls):
        rospy.loginfo("of class")

    @staticmethod
    def static():
        rospy.loginfo("static")


class Derived(Base):
    pass


def function():
    rospy.loginfo("function")


begin("logged")
Derived().method()
Derived.of_class()
Derived.static()
function()
rospy.loginfo("module")
for stream in (out, err):
    examine("lines", lambda: stream.getvalue().splitlines())

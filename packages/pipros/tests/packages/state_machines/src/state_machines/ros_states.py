"""States that run an action, call a service, or wait for a message."""

import threading

import rospy
from actionlib.simple_action_client import GoalStatus, SimpleActionClient
from state_machines.states import State


class SimpleActionState(State):
    """Send a goal, and wait for its result."""

    def __init__(self, name, spec, goal_cb, result_cb=None, exec_timeout=None, **keys):
        State.__init__(self, ["succeeded", "aborted", "preempted"], **keys)
        self.client = SimpleActionClient(name, spec)
        self.goal_cb, self.result_cb, self.exec_timeout = goal_cb, result_cb, exec_timeout
        self.ended = threading.Event()

    def request_preempt(self):
        State.request_preempt(self)
        self.client.cancel_goal()

    def execute(self, userdata):
        while not self.client.wait_for_server(rospy.Duration(1.0)):
            if rospy.is_shutdown() or self.preempt_requested():
                self.service_preempt()
                return "preempted"
        self.ended.clear()
        start = rospy.Time.now()
        self.client.send_goal(
            self.goal_cb(userdata), done_cb=lambda *_: self.ended.set(), feedback_cb=lambda _: None
        )
        while not self.ended.wait(0.05) and not rospy.is_shutdown():
            if self.exec_timeout and rospy.Time.now() - start > self.exec_timeout:
                self.client.cancel_goal()
        state, result = self.client.get_state(), self.client.get_result()
        if self.result_cb is not None:
            self.result_cb(userdata, state, result)
        if self.preempt_requested():
            self.service_preempt()
        if state == GoalStatus.SUCCEEDED:
            return "succeeded"
        return "preempted" if state in (GoalStatus.PREEMPTED, GoalStatus.RECALLED) else "aborted"


class ServiceState(State):
    """Calls a service."""

    def __init__(self, name, spec, request_cb=None, response_cb=None, **keys):
        State.__init__(self, ["succeeded", "aborted", "preempted"], **keys)
        self.proxy = rospy.ServiceProxy(name, spec)
        self.request_cb, self.response_cb = request_cb, response_cb

    def execute(self, userdata):
        while True:
            try:
                self.proxy.wait_for_service(1.0)
                break
            except rospy.ROSException:
                if rospy.is_shutdown() or self.preempt_requested():
                    return "preempted"
        try:
            response = self.proxy.call(
                self.request_cb(userdata) if self.request_cb else self.proxy.request_class()
            )
        except rospy.ServiceException as error:
            rospy.logwarn("%s failed: %s", self.proxy.resolved_name, error)
            return "aborted"
        found = self.response_cb(userdata, response) if self.response_cb else None
        return found or "succeeded"


class MonitorState(State):
    """Wait while the messages of a topic meet a condition."""

    def __init__(self, topic, message_class, cond_cb, **keys):
        State.__init__(self, ["valid", "invalid", "preempted"], **keys)
        self.topic, self.message_class, self.cond_cb = topic, message_class, cond_cb
        self.broken = threading.Event()

    def request_preempt(self):
        State.request_preempt(self)
        self.broken.set()

    def execute(self, userdata):
        self.broken.clear()
        if self.preempt_requested():
            self.service_preempt()
            return "preempted"
        subscriber = rospy.Subscriber(
            self.topic, self.message_class, self._on_message, callback_args=userdata
        )
        self.broken.wait()
        subscriber.unregister()
        if self.preempt_requested():
            self.service_preempt()
            return "preempted"
        return "invalid"

    def _on_message(self, message, userdata):
        if not self.cond_cb(userdata, message):
            self.broken.set()

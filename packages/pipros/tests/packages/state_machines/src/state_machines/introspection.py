"""Publishes the active states."""

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

import rospy
from state_machines.containers import Container


class IntrospectionServer:
    """Publish the active states of a container and of nested ones on `NAME/container_status`."""

    def __init__(self, name, container, path):
        self.name, self.container, self.path = name, container, path
        self.paths = {}
        self.publisher = None

    def start(self):
        self.publisher = rospy.Publisher(
            self.name + "/container_status", DiagnosticStatus, queue_size=100, latch=True
        )
        self._listen(self.container, self.path)

    def stop(self):
        for container in self.paths:
            container.listeners.remove(self._on_change)
        self.publisher.unregister()

    def _listen(self, container, path):
        self.paths[container] = path
        container.listeners.append(self._on_change)
        for label, state in container.states.items():
            if isinstance(state, Container):
                self._listen(state, path + "/" + label)

    def _on_change(self, container, active):
        values = [KeyValue(key, str(value)) for key, value in container.userdata.items()]
        self.publisher.publish(
            name=self.paths[container],
            message=",".join(sorted(active)),
            hardware_id=rospy.get_name(),
            values=values,
        )

"""Change the parameters of serve_parameters.py, and print the results."""

import rospy
from dynamic_reconfigure import DynamicReconfigureParameterException, find_reconfigure_services
from dynamic_reconfigure.client import Client


def plain(value):
    if isinstance(value, dict):
        return sorted((name, plain(part)) for name, part in value.items())
    return [plain(part) for part in value] if isinstance(value, list) else value


rospy.init_node("tuner")
seen = []
client = Client("tuned", timeout=60, config_callback=lambda config: seen.append(config))
print(plain(client.get_configuration(timeout=60)))
print(plain(client.get_parameter_descriptions(timeout=60)))
print(plain(client.get_group_descriptions(timeout=60)))
for changes in (
    {"gain": 3}, {"gain": "-99", "on": "no"}, {"size": "Large"}, {"size": 1, "name": "x"},
    {"count": 7, "flag": True, "free": 1e300}, {},
):  # fmt: skip
    print(plain(client.update_configuration(changes)))
for changes in ({"nothing": 1}, {"gain": "much"}):
    try:
        client.update_configuration(changes)
    except DynamicReconfigureParameterException as error:
        print(error)
print(rospy.get_param("/tuned/gain"), rospy.get_param("/tuned/name"), find_reconfigure_services())
while not (seen and seen[-1]["count"] == 7) and not rospy.is_shutdown():
    rospy.sleep(0.01)
client.close()

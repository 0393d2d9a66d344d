"""The services of rospy, by their old address."""

from rospy.service import Service as Service
from rospy.service import ServiceProxy as ServiceProxy
from rospy.service import convert_return_to_response as convert_return_to_response
from rospy.service import wait_for_service as wait_for_service

"""Commands of the case study, and patterns of their output."""

TALKER = "rosrun composiv_tryouts composiv_talker.py"
LISTENER = "rosrun composiv_tryouts composiv_listener.py"
TEST = "rosrun composiv_tryouts test_talker.py"
LAUNCH = "roslaunch composiv_tryouts composiv_tryout.launch"
ROSTEST = "rostest composiv_tryouts composiv_tryout.launch"

CORE_IS_UP = r"started core service \[/rosout\]"
SAID = r"\[INFO\] \[\d{10}\.\d{6}\]: %25"
HEARD = r"\[INFO\] \[\d{10}\.\d{6}\]: Battery level of vehicle: %25"

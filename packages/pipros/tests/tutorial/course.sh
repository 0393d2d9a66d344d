#!/usr/bin/env bash
# The beginner tutorials, as a student types them, on an installed pipros: `packages/pipros/tests/tutorial/course.sh`, in an empty folder.
# `script/fresh SUITE course` runs it on a bare Debian. Each step that fails ends it with the line and the logs of its programs.
set -euo pipefail
export ROS_MASTER_URI=http://localhost:$((20000 + RANDOM % 10000)) ROS_HOME=$PWD/ros_home
logs=$PWD/logs
mkdir -p "$logs"
running=()
clean_up() {
  local code=$?
  [ "$code" = 0 ] || tail -n 20 "$logs"/* >&2
  kill "${running[@]}" 2>/dev/null || true
  wait
  [ "$code" != 0 ] || echo "course: done"
}
trap clean_up EXIT
trap 'echo "course.sh: line $LINENO failed: $BASH_COMMAND" >&2' ERR

# Starts a program of another terminal. Its output goes to a log.
open() {
  local name=$1
  shift
  "$@" >"$logs/$name" 2>&1 </dev/null &
  running+=($!)
}
# Repeats a command until it succeeds and its output contains the text, for at most a minute.
until_shows() {
  local text=$1 end=$((SECONDS + 60)) output
  shift
  until output=$("$@" 2>&1) && grep -qF -- "$text" <<<"$output"; do
    [ "$SECONDS" -lt "$end" ] || { printf '%s\n%s\n' "no [$text] from: $*" "$output" >&2 && return 1; }
    sleep 0.2
  done
}

set +u # bash completion
eval "$(pipros env)"
set -u
[ "$ROS_DISTRO" = noetic ]

echo "== turtles"
open roscore roscore --port "${ROS_MASTER_URI##*:}"
until_shows /rosout rosnode list
open turtlesim rosrun turtlesim turtlesim_node _headless:=true
until_shows /turtle1/pose rostopic list
open circle rostopic pub /turtle1/cmd_vel geometry_msgs/Twist -r 5 -- '[2.0, 0.0, 0.0]' '[0.0, 0.0, 1.8]'
until_shows 'linear_velocity: 2.0' rostopic echo -n 1 /turtle1/pose
rosservice call /spawn 2 2 0.2 "" | grep -qF turtle2
rosparam set /turtlesim/background_r 150
[ "$(rosparam get /turtlesim/background_r)" = 150 ]
rosnode info turtlesim | grep -qF /turtle1/cmd_vel

echo "== bags"
rosbag record -O subset --duration=2 /turtle1/cmd_vel /turtle1/pose >/dev/null 2>&1
rosbag info subset.bag | grep -qF turtlesim/Pose
rosbag play -r 4 subset.bag >/dev/null
roswtf | grep -qF 'Static checks summary'

echo "== a package"
mkdir -p catkin_ws/src
cd catkin_ws/src
catkin_create_pkg beginner_tutorials std_msgs rospy roscpp >/dev/null
cd ..
catkin_make >/dev/null
set +u
# shellcheck source=/dev/null
. devel/setup.bash
set -u
roscd beginner_tutorials
mkdir -p msg srv scripts launch
echo "int64 num" >msg/Num.msg
rosmsg show beginner_tutorials/Num | grep -qF "int64 num"
roscp rospy_tutorials AddTwoInts.srv srv/AddTwoInts.srv
rossrv show beginner_tutorials/AddTwoInts | grep -qF "int64 sum"

echo "== publisher and subscriber"
cat >scripts/talker.py <<'PYTHON'
#!/usr/bin/env python
import rospy
from beginner_tutorials.msg import Num

rospy.init_node("talker")
publisher = rospy.Publisher("numbers", Num, queue_size=10)
rate = rospy.Rate(10)
number = 0
while not rospy.is_shutdown():
    publisher.publish(number)
    number += 1
    rate.sleep()
PYTHON
cat >scripts/listener.py <<'PYTHON'
#!/usr/bin/env python
import rospy
from beginner_tutorials.msg import Num

rospy.init_node("listener")
rospy.Subscriber("numbers", Num, lambda message: rospy.loginfo("heard %d", message.num))
rospy.spin()
PYTHON
chmod +x scripts/*.py
echo '<launch>
  <node pkg="beginner_tutorials" type="talker.py" name="talker"/>
  <node pkg="beginner_tutorials" type="listener.py" name="listener" output="screen"/>
</launch>' >launch/both.launch
open launch roslaunch beginner_tutorials both.launch
until_shows "heard 1" cat "$logs/launch"

echo "== service and client"
cat >scripts/add_server.py <<'PYTHON'
#!/usr/bin/env python
import rospy
from beginner_tutorials.srv import AddTwoInts, AddTwoIntsResponse

rospy.init_node("add_server")
rospy.Service("add", AddTwoInts, lambda request: AddTwoIntsResponse(request.a + request.b))
rospy.spin()
PYTHON
chmod +x scripts/add_server.py
open server rosrun beginner_tutorials add_server.py
until_shows /add rosservice list
until_shows "sum: 5" rosservice call /add 2 3

echo "== transforms and robots"
open demo roslaunch --wait turtle_tf2 turtle_tf2_demo.launch
open frames rosrun tf tf_echo turtle1 turtle2
until_shows Translation cat "$logs/frames"
cd "$ROS_HOME"
echo '<robot name="arm"><link name="base"/></robot>' >arm.urdf
check_urdf arm.urdf | grep -qF "robot name is: arm"

#!/usr/bin/env bash
# A package with C++ beside Python, on an installed pipros and genuine catkin and roscpp: `packages/pipros/tests/tutorial/mixed.sh`, in an empty folder.
# `script/fresh trixie mixed` runs it on a bare Debian with these packages.
set -euo pipefail
package=$(cd "$(dirname "${BASH_SOURCE[0]}")/../packages/mixed" && pwd)
export ROS_MASTER_URI=http://localhost:$((20000 + RANDOM % 10000)) ROS_HOME=$PWD/ros_home
mkdir -p catkin_ws/src
cp -r "$package" catkin_ws/src/
cd catkin_ws
catkin_make
set +u
# shellcheck source=/dev/null
. devel/setup.bash
set -u
roslaunch mixed both.launch >launch.log 2>&1 </dev/null &
launch=$!
trap 'kill "$launch" && wait "$launch"' EXIT
end=$((SECONDS + 60))
# The sum comes from C++, and the module of rospy belongs to pipros.
until report=$(timeout 10 rostopic echo -n 1 /report); do
  if [ "$SECONDS" -ge "$end" ]; then cat launch.log >&2 && exit 1; fi
done
echo "$report"
rospy=$(python3 -c 'import rospy; print(rospy.__file__)')
case $report in *"north 1.5 7 $rospy"*) echo "mixed: done" ;; *) exit 1 ;; esac

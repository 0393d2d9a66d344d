"""Which test runs each block of README.md and docs/.

`tests.tutorial.test_docs` checks that every block is in one of these tables, and that its test reads the page
or contains the same words.
"""

import re

BLOCK = re.compile(r'^```(\w+)(?: title="([^"]+)")?\n(.*?)^```$', re.MULTILINE | re.DOTALL)
"""A block of a page: its language, its title, and its content."""

CORE, PAGE, ROBOT = "packages/pipros/tests", "packages/pipros-page/tests", "plugins/pipros-robot/tests"
BRIDGES, ROSBAG2 = "packages/pipros-bridges/tests", "packages/pipros-rosbag2/tests"
TOOLS = "packages/pipros-tools/tests"
FLEET, ROS2 = "plugins/pipros-fleet/tests", "plugins/pipros-ros2/tests"
ASSISTANTS, DATA, WHEELS = (f"plugins/pipros-{name}/tests" for name in ("assistants", "data", "wheels"))
_TAB = "plugins/pipros-tab/tests/pyodide/test_terminal.py"
_TURTLEBOT3 = f"{ROBOT}/graph/test_simulated_driving.py"

RUN_HERE = (
    "start/laptop.md", "guides/package.md", "start/robot.md", "guides/course.md", "guides/simulation.md",
)  # fmt: skip
"""The pages whose commands `test_docs` types into terminals; it also writes the files that have titles."""

_READ_BY = {
    f"{CORE}/tutorial/test_readme.py": ["README.md console python sh"],
    f"{CORE}/tutorial/test_doc_examples.py": [
        "reference/python.md python",
        "guides/testing.md ini yaml",
        "internals/client.md python",
    ],
    f"{ASSISTANTS}/graph/test_assistant_command.py": ["guides/assistants.md console yaml"],
    f"{ASSISTANTS}/unit/assistants/test_docs.py": ["guides/assistants.md json"],
    f"{TOOLS}/unit/bag/test_docs.py": ["guides/bags.md python"],
    f"{CORE}/tree/test_other_systems.py": ["guides/tab.md python"],
    f"{DATA}/unit/data/test_docs.py": ["guides/data.md console python yaml"],
    f"{FLEET}/unit/fleet/test_examples.py": ["guides/fleets.md yaml"],
    f"{CORE}/graph/test_launch_facade.py": ["guides/launch.md python"],
    f"{CORE}/unit/msg/test_docs.py": ["guides/package.md python"],
    f"{ROBOT}/unit/navigation/costmap/test_layers.py": ["guides/navigation.md toml"],
    f"{WHEELS}/tutorial/test_pip.py": ["guides/pip.md bash python toml"],
    f"{TOOLS}/unit/cli/test_policy.py": ["guides/policy.md console yaml"],
    f"{ROS2}/interop/test_walk.py": ["guides/ros2.md bash xml"],
    f"{ROS2}/interop/test_one_environment.py": ["guides/ros2.md python"],
    f"{ROS2}/unit/ros2/test_docs.py": ["guides/ros2.md yaml"],
    f"{ROS2}/unit/ros2/rtps/test_participant.py": ["internals/rtps.md python"],
    f"{CORE}/graph/test_pytest_plugin.py": ["guides/testing.md console python xml"],
}
"""Pages with the languages of their blocks, by the test that reads all these blocks and runs them."""

READ_BY = {
    (page, language): test
    for test, blocks in _READ_BY.items()
    for page, *languages in map(str.split, blocks)
    for language in languages
}

SHOWN_BY: dict[tuple[str, tuple[str, ...]], str] = {
    ("guides/launch.md", ("roslaunch", "--dry-run")): f"{TOOLS}/unit/cli/test_roslaunch.py",
    ("guides/workspaces.md", ("catkin_make", "devel/setup.bash")): f"{CORE}/support/case_study.py",
    ("guides/workspaces.md", ("ROS_PACKAGE_PATH=",)): f"{CORE}/tutorial/test_how.py",
    ("reference/commands.md", ("pipros env",)): f"{CORE}/tutorial/course.sh",
    ("reference/settings.md", ("PIPROS_LIMITS",)): f"{CORE}/unit/basics/test_limits.py",
    ("guides/bags.md", ("--split", "--size", "--clock")): f"{CORE}/graph/test_rosbag_record_play.py",
    ("guides/bags.md", ("merge", "--at", "--repeat-latched", "--every")): f"{TOOLS}/unit/bag/test_parts.py",
    ("guides/bags.md", ("convert", "--output-dir", "--jobs")): f"{TOOLS}/unit/bag/test_converting_many.py",
    ("guides/bags.md", ("convert", "--ros2", "jazzy")): f"{ROSBAG2}/unit/rosbag2/test_bags.py",
    ("guides/bridges.md", ("foxglove", "--control")): f"{BRIDGES}/graph/test_serve.py",
    ("guides/bridges.md", ("foxglove_bridge", "address")): f"{BRIDGES}/graph/test_serve.py",
    ("guides/bridges.md", ("rosbridge_websocket.launch",)): f"{BRIDGES}/graph/test_rosbridge.py",
    ("guides/bridges.md", ("serviceType:", "messageType:")): f"{BRIDGES}/clients/programs/client.mjs",
    ("guides/bridges.md", ("roslibpy.Ros", "roslibpy.Topic")): f"{BRIDGES}/clients/programs/client.py",
    ("guides/bridges.md", ("serve:", "serve")): f"{BRIDGES}/graph/test_stop_guardian.py",
    ("guides/bridges.md", ("--token-file", "foxglove.sdk.v1")): f"{BRIDGES}/graph/test_serve.py",
    ("guides/classroom.md", ("wheel", "--wheel-dir", "download", "--dest wheels")): f"{CORE}/tutorial/lab.sh",
    ("guides/classroom.md", ("for each in handed",)): f"{CORE}/tutorial/test_4_5_launch_file.py",
    ("guides/classroom.md", ("python3 -m venv", "--no-index --find-links wheels")): f"{CORE}/tutorial/lab.sh",
    ("guides/classroom.md", ("roscore", "--allow")): f"{CORE}/graph/test_launch_run.py",
    ("guides/containers.md", ("11410-11419", "roscore")): f"{CORE}/interop/test_nat.py",
    ("guides/containers.md", ("PIPROS_PORTS", "31400-31409")): f"{CORE}/interop/test_nat.py",
    ("guides/data.md", ("lerobot-replay", "--robot.type=ros1")): f"{DATA}/support/lerobot_dataset.py",
    ("guides/fleets.md", ("operator", "/robot1/chatter")): f"{FLEET}/interop/test_fleet_with_genuine.py",
    ("guides/fleets.md", ("--history", "--history-topic")): f"{FLEET}/graph/test_fleet_history.py",
    ("guides/fleets.md", ("keys", "create", "--router")): f"{FLEET}/graph/test_fleet_history.py",
    ("guides/launch.md", ("env-loader=", "user=")): f"{CORE}/graph/test_launch_run.py",
    ("guides/launch.md", ('exec "$@"',)): f"{CORE}/graph/test_launch_run.py",
    ("guides/libraries.md", ("rospy", "zero_copy")): f"{CORE}/graph/test_documented_nodes.py",
    ("guides/libraries.md", ("compressed_imgmsg_to_cv2(message",)): f"{CORE}/graph/test_documented_nodes.py",
    ("guides/libraries.md", ("class Brightness",)): f"{CORE}/graph/test_documented_nodes.py",
    ("guides/libraries.md", ("import sys", "class Nearest")): f"{CORE}/graph/test_documented_nodes.py",
    ("guides/libraries.md", ("from nearest import",)): f"{CORE}/graph/test_documented_nodes.py",
    ("guides/libraries.md", ("twist_mux", "locks:")): f"{CORE}/graph/test_teleoperation.py",
    (
        "reference/libraries.md",
        ("neighbors:", "min_angle:"),
    ): f"{CORE}/packages/cloud_launches/config/laser.yaml",
    ("guides/libraries.md", ("pipros.nodelets",)): f"{CORE}/graph/test_nodelets.py",
    ("guides/package.md", ("control_msgs",)): f"{CORE}/interop/test_mixed_packages.py",
    ("guides/navigation.md", ("ROS_PACKAGE_PATH", "turtlebot3")): _TURTLEBOT3,
    ("guides/navigation.md", ("turtlebot3_robot.launch",)): _TURTLEBOT3,
    ("guides/navigation.md", ("turtlebot3_slam.launch",)): _TURTLEBOT3,
    ("guides/navigation.md", ("map_saver",)): _TURTLEBOT3,
    ("guides/navigation.md", ("turtlebot3_navigation.launch",)): _TURTLEBOT3,
    ("guides/navigation.md", ("/move_base_simple/goal", "geometry_msgs/PoseStamped")): _TURTLEBOT3,
    ("guides/navigation.md", ("two_d_mode:", "odom0_config:")): f"{ROBOT}/graph/test_robot_localization.py",
    ("guides/navigation.md", ("explore_lite",)): f"{ROBOT}/graph/test_explore_lite.py",
    ("guides/navigation.md", ("/maps/room.yaml", "amcl")): f"{CORE}/support/launch_sets/in_a_group.launch",
    ("guides/navigation.md", ("gmapping", "ymin")): f"{ROBOT}/golden/navigation/test_gmapping_as_genuine.py",
    (
        "guides/navigation.md",
        ("observation_sources:", "clearing:"),
    ): f"{CORE}/support/launch_sets/clearpath.launch",
    (
        "guides/navigation.md",
        ("world.reaches", "world.never_closer_than"),
    ): f"{ROBOT}/support/apartment_drives.py",
    ("guides/navigation.md", ("class ", "Layer")): f"{ROBOT}/unit/navigation/costmap/test_layers.py",
    ("guides/navigation.md", ("sim-for",)): f"{ROBOT}/graph/test_simulated_driving.py",
    ("guides/page.md", ("rqt_graph", "With --control, it can")): f"{PAGE}/graph/test_page_tabs.py",
    ("guides/page.md", ("--perspective-file", "rqt_gui")): f"{PAGE}/graph/test_page_tabs.py",
    ("guides/page.md", ("rqt_graph", "--token-file")): f"{PAGE}/browser/test_access.py",
    ("guides/page.md", ("--cert", "--key")): f"{PAGE}/graph/test_page_tabs.py",
    ("guides/pip.md", ("--init", "my_robot_msgs")): f"{WHEELS}/tutorial/test_pip.py",
    ("guides/pip.md", ("PIP_FIND_LINKS=FOLDER",)): f"{WHEELS}/tutorial/test_pip.py",
    ("start/robot.md", ("ROS_IP", "doctor")): f"{CORE}/graph/test_tools_across_networks.py",
    ("start/robot.md", ("roscore", "--bind")): f"{CORE}/graph/test_launch_run.py",
    ("guides/ros2.md", ("--domain", "--distro")): f"{ROS2}/graph/test_ros2_command.py",
    ("guides/scene.md", ("rviz", "navigation.rviz")): f"{ROBOT}/browser/test_navigation_example.py",
    ("guides/simulation.md", ("lockstep:=", "[amcl, move_base]")): f"{ROBOT}/graph/test_simulated_driving.py",
    ("start/tab.md", ("mkdir feature",)): _TAB,
    ("start/tab.md", ("catkin_create_pkg",)): _TAB,
    ("start/tab.md", ("echo string battery > msg/BatteryLevel.msg",)): _TAB,
    ("start/tab.md", ("/opt/ros/noetic/setup.bash",)): _TAB,
    ("start/tab.md", ("roscore",)): _TAB,
    ("start/tab.md", ("rosrun composiv_tryouts composiv_talker.py",)): _TAB,
    ("start/tab.md", ("rosrun composiv_tryouts composiv_listener.py",)): _TAB,
    ("start/tab.md", ("battery.bag", "--duration")): _TAB,
    ("start/tab.md", ("rostest composiv_tryouts composiv_tryout.launch",)): _TAB,
    ("reference/commands.md", ("--csv", "--without")): f"{TOOLS}/unit/cli/test_roslaunch.py",
}
"""By page and words that only one of its blocks contains: the test that reads the page or has these words."""

NOT_RUN = {
    ("guides/classroom.md", ("%USERPROFILE%",)): "installation on Windows, as script/demo.cmd does it",
    ("guides/from-noetic.md", ("--force-reinstall",)): "installs",
    ("guides/libraries.md", ("pip install",)): "installs",
    ("guides/ros2.md", ("pip install . ./plugins/pipros-ros2",)): "installs a plugin",
    ("guides/tab.md", ("script/generate tab",)): "installs from npm; tests/pyodide runs these files",
    ("guides/tab.md", ("--cert FILE",)): "needs a certificate that browsers trust",
    ("guides/workspaces.md", ("sudo apt",)): "installs Debian's packages",
    ("start/tab.md", ("script/generate tab",)): "installs from npm; tests/pyodide runs these files",
    ("guides/assistants.md", ("pip install . ./plugins/pipros-assistants",)): "installs a plugin",
    ("guides/classroom.md", ("ROS_NAMESPACE=$USER",)): "settings on the computers of a class",
    (
        "guides/containers.md",
        ("docker", "roslaunch my_robot"),
    ): "needs Docker; interop/test_nat.py has such settings",
    ("guides/containers.md", ("status.podIP",)): "needs Kubernetes",
    ("guides/data.md", ("pip install . ./plugins/pipros-data",)): "installs a plugin",
    ("guides/navigation.md", ("./plugins/pipros-robot",)): "installs a plugin",
    ("guides/plugins.md", ("pip install . ./plugins/pipros-robot",)): "installs a plugin",
    ("guides/plugins.md", ("PLUGIN = Plugin(",)): "a declaration like those of test_plugins.py",
    ("start/robot.md", ("ROS_IP=192.168.1.20",)): "settings on a robot, whose address the test machine lacks",
    ("guides/ros2.md", ("--ros2-python", "/usr/bin/python3")): "needs ROS 2; test_rclpy_engine.py has wheels",
    (
        "guides/ros2.md",
        ("ros-jazzy-rclpy",),
    ): "installs from PyPI what tests/support/ros2_wheels.py installs, too",
    ("start/laptop.md", ("python3 -m venv .venv",)): "installation, which script/fresh does on a bare system",
    ("start/laptop.md", ("\n. .venv/bin/activate\n",)): "activates the environment that the tests run in",
    ("start/laptop.md", ("py -m venv .venv &&",)): "installation on Windows, as script/demo.cmd does it",
}
"""By page and words that only one of its blocks contains: why no test runs the block."""

"""The ROS packages of Debian 12 that CMake can find.

The names come from the files `*Config.cmake` in Debian packages with the homepage wiki.ros.org, and in
libmap-msgs-dev and libmove-base-msgs-dev. `apt-cache dumpavail` lists the packages, `apt-get download`
fetches those that are not installed, and `dpkg --contents` and `dpkg --listfiles` list their files.
"""

_NAMES = """
    actionlib actionlib_msgs actionlib_tools angles bond bondcpp bondpy camera_calibration
    camera_calibration_parsers camera_info_manager catkin class_loader cmake_modules collada_parser
    collada_urdf cpp_common cv_bridge depth_image_proc diagnostic_aggregator diagnostic_analysis
    diagnostic_common_diagnostics diagnostic_msgs diagnostic_updater dynamic_reconfigure eigen_conversions
    eigen_stl_containers gencpp genlisp genmsg genpy geometric_shapes geometry_msgs image_geometry
    image_proc image_publisher image_rotate image_transport image_view interactive_markers
    joint_state_publisher joint_state_publisher_gui kdl_conversions kdl_parser laser_geometry map_msgs
    message_filters message_generation message_runtime mk move_base_msgs nav_msgs nodelet
    nodelet_topic_tools opencv_apps pcl_conversions pcl_msgs pcl_ros pluginlib polled_camera
    python_qt_binding random_numbers resource_retriever robot_state_publisher ros_environment rosbag
    rosbag_storage rosbash rosboost_cfg rosbuild rosclean rosconsole rosconsole_bridge roscpp
    roscpp_serialization roscpp_traits roscreate rosdiagnostic rosgraph rosgraph_msgs roslang roslaunch
    roslib roslisp roslz4 rosmake rosmaster rosmsg rosnode rosout rospack rosparam rospy rosservice rostest
    rostime rostopic rosunit roswtf rviz self_test sensor_msgs shape_msgs smclib std_msgs std_srvs
    stereo_image_proc stereo_msgs tf tf2 tf2_bullet tf2_eigen tf2_geometry_msgs tf2_kdl tf2_msgs tf2_py
    tf2_ros tf2_sensor_msgs tf2_tools tf_conversions topic_tools trajectory_msgs urdf urdf_parser_plugin
    visualization_msgs xmlrpcpp
"""

FOUND_BY_CMAKE = tuple(_NAMES.split())

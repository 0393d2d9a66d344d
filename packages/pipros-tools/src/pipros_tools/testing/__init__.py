"""Test runners for ROS packages: rostest and rosunit, and result files in xUnit format."""

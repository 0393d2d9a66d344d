"""Test runners for ROS packages: rostest, rosunit, and result files in the xUnit format."""

"""Running tests of ROS packages: rostest, rosunit, and result files in the xUnit format."""

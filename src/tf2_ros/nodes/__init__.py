"""The programs of the package tf2_ros."""

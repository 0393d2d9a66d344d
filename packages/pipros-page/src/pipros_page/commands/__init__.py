"""The commands of the page: rqt and its plugins, and rviz."""

"""Launch files, bags, the graph, health, tests, and the commands with the names of ROS."""

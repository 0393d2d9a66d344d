"""Code shared by the rosbridge and Foxglove servers, which connect browsers and other programs to ROS."""

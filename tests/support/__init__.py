"""What all tests share: conditions to wait for, free ports, processes, terminals, genuine ROS."""

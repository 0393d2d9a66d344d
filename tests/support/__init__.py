"""What tests of every room share: conditions to wait for, free ports, processes, terminals, genuine ROS."""

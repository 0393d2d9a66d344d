"""Control a live robot with a policy or a teleoperator, through the topics in `robot.yaml`."""

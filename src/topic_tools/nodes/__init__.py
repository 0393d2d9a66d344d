"""The programs of `rosrun topic_tools …`."""

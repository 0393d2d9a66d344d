"""The node of tf2_web_republisher, which sends chosen transforms to clients of rosbridge."""

"""The node of tf2_web_republisher, which sends requested transforms to rosbridge clients."""

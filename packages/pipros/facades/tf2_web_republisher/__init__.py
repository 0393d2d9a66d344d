"""tf2_web_republisher: a node that sends requested transforms to rosbridge clients."""

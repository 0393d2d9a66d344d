"""Package that contains cv_bridge's compiled module in Noetic."""

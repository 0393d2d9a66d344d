"""Package that contains `cv_bridge_boost`, which is a compiled module in Noetic."""

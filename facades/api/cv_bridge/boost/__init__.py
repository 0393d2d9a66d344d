"""The package of cv_bridge's compiled module in Noetic."""

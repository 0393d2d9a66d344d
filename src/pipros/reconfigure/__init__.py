"""The `.cfg` files of dynamic_reconfigure: their declarations, and the Python modules made from these."""

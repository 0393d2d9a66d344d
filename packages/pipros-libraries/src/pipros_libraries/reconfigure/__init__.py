"""Read `.cfg` files of dynamic_reconfigure, and create Python modules from their declarations."""

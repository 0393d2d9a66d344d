"""The `.cfg` files of dynamic_reconfigure: what they declare, and the Python modules made from that."""

"""The life of a bond: what one side does when the other one is heard of or not."""

"""The commands `pipros wheel`, `pipros install` and `pipros index`, and `rosdep`."""

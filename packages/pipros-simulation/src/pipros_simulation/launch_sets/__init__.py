"""The robot that launch files of navigation expect, and a launch file that simulates it."""

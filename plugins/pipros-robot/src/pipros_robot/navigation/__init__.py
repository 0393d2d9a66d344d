"""Navigation for mobile robots: state estimation, costmaps and planners. See docs/guides/navigation.md.

Each folder contains a library that performs no I/O, and a node that connects the library to topics. All
folders need numpy, and some need OpenCV. No other package in pipros
imports this one.
"""

"""Navigation for mobile robots: state estimation, maps of costs, planners. See docs/navigation.md.

Each folder is one part, with a pure library and a node that connects it to topics. The parts need numpy, and
some need OpenCV: `pip install "pipros[navigation]"`. No other package of pipros imports this one.
"""

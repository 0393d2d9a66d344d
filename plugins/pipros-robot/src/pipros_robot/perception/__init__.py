"""Images, point clouds, laser scans and inertial sensors: nodelets and programs, and drivers of lidars.

`windows/` shows OpenCV's windows on a page.
"""

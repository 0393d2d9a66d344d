"""Robots described by URDF: links, joints, and the poses of links for given joint positions.

Start with `urdf.py`.
"""

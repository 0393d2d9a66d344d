"""Robots described by URDF: links, joints, and the poses of links for positions of joints.

Begin with `urdf.py`.
"""

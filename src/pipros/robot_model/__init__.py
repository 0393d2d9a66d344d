"""Robots as URDF describes them: links, joints, and where a joint's position puts a link.

Begin with `urdf.py`.
"""

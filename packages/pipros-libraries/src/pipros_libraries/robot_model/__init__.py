"""Robot models from URDF: links, joints, and link poses for given joint positions.

Start with `urdf.py`.
"""

"""The local planner TrajectoryPlannerROS of `base_local_planner`, built on the sampling of `dwa`.

B. Gerkey and K. Konolige, "Planning and control in unstructured terrain", ICRA Workshop on Path Planning on
Costmaps, 2008. `planner.py` is the algorithm; only `trajectory_node.py` uses topics.
"""

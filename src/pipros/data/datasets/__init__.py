"""Data sets for training, made from bags: episodes with one rate, as a `robot.yaml` describes them.

`config.py` reads the description. `episodes.py` finds episodes, `signals.py` and `cameras.py` read topics,
`grid.py` aligns them with the rows, `checks.py` examines them, and `build.py` runs all of this.
"""

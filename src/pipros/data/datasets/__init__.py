"""Data sets for training, made from bags: episodes at a constant rate, as described in a `robot.yaml`.

`config.py` reads the description. `episodes.py` finds episodes, `signals.py` and `cameras.py` read topics,
`rows.py` aligns them with the rows, `checks.py` examines them, and `build.py` runs all of this.
"""

"""Data sets for training, made from bags: episodes at a constant rate, as described in a `robot.yaml`.

`config.py` reads the description. `episodes.py` finds episodes, `signals.py` and `cameras.py` read topics,
`rows.py` aligns their messages with the rows of an episode, `checks.py` examines the topics, and `build.py`
runs all of these steps.
"""

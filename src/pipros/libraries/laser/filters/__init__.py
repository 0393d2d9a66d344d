"""The filters of laser_filters and the chains that run them. Start with `base.py` and `chain.py`."""

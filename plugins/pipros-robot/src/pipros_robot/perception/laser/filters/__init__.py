"""The filters of laser_filters, and filter chains. Start with `base.py` and `chain.py`."""

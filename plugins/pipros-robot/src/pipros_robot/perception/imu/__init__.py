"""Orientation from inertial measurement units: two filters, and their nodes."""

"""Odometry from laser scans alone, like laser_scan_matcher."""

#!/usr/bin/env python3
"""Prints the folder of test results."""

import rospkg

print(rospkg.get_test_results_dir())

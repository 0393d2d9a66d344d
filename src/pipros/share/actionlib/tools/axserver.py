#!/usr/bin/env python3
import sys

from actionlib_tools.axserver import main

sys.exit(main())

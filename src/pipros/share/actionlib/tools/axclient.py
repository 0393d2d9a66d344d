#!/usr/bin/env python3
import sys

from actionlib_tools.axclient import main

sys.exit(main())

#!/usr/bin/env python3
import sys

from tf2_ros.nodes.echo import main

sys.exit(main())

#!/usr/bin/env python3
import sys

from pipros_tools.cli.entry_point import command
from tf2_ros.nodes.echo import main

sys.exit(command(main)())

#!/usr/bin/env python3
import sys

from pipros_libraries.teleoperation.keyboard_node import main
from pipros_tools.cli.entry_point import command

sys.exit(command(main)())

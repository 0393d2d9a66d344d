#!/usr/bin/env python3
import sys

from pipros.cli.entry_point import command
from pipros.libraries.teleoperation.keyboard_node import main

sys.exit(command(main)())

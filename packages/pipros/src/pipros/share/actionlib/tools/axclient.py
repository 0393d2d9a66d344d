#!/usr/bin/env python3
import sys

from actionlib_tools.axclient import main
from pipros_tools.cli.entry_point import command

sys.exit(command(main)())

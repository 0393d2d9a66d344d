#!/usr/bin/env python3
import sys

from pipros_tools.cli.entry_point import command
from tf.nodes.view_frames import main

sys.exit(command(main)())

#!/usr/bin/env python3
import sys

from pipros.cli.streams import command
from tf2_ros.nodes.echo import main

sys.exit(command(main)())

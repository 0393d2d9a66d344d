#!/usr/bin/env python3
import sys

from tf.nodes.view_frames import main

sys.exit(main())

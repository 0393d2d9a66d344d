#!/usr/bin/env python3
import sys

from diagnostic_analysis.export_csv import main

sys.exit(main())

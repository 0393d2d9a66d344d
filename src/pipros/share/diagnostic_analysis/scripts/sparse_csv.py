#!/usr/bin/env python3
import sys

from diagnostic_analysis.sparse_csv import main

sys.exit(main())

"""`python -m dem_demo`."""

import sys

from .cli import main

sys.exit(main())

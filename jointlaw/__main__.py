"""`python -m jointlaw` is the command `jointlaw`."""

import sys

from .cli import main

sys.exit(main())

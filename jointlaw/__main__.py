"""`python -m jointlaw` is the command `jointlaw`."""

import sys

from .cli.main import main

sys.exit(main())

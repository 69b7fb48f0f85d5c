"""Laws, checks and measures at the extremes, shared by the tests and by docs/make_extremes.py."""

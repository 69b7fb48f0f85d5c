"""Accuracy of resolutions: standard paths, cost and error, the law for a tolerance."""

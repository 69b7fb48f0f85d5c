"""jointlaw."""

"""Host codes: one folder each, with what it needs to run a joint law."""

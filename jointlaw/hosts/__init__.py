"""Host codes: what they need on disk to run a joint law."""

from .yade import export_yade

__all__ = ["export_yade"]

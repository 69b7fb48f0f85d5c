"""How accurate a resolution is: the standard paths, the price list, and the law for a tolerance."""

"""Studies: many runs of one scene.

compare      every rock alone, for several seeds, with plain Coulomb as well
ingredients  a scene without each of its ingredients
ablate       runs of these, and what each changes
"""

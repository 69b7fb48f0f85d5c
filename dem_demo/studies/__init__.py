"""Studies: many runs of one scene.

compare      every rock alone, for several seeds, with plain Coulomb as well
limit        the critical tilt and the strength reduction factor of a scene
strength     these for every rock alone, and how it then fails
ingredients  a scene without each of its ingredients
ablate       runs of these, and what each changes
"""

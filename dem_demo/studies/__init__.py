"""Studies: many runs of one scene.

compare    every rock alone, for several seeds, with plain Coulomb as well
strength   how much weaker the joints may be, and the critical tilt
ablate     a scene without each of its ingredients: what that changes
"""

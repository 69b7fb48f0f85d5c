"""Studies: many runs of one scene.

compare    every rock alone, for several seeds, with plain Coulomb as well
strength   the factor of safety, the critical tilt, and how a scene fails
ablate     a scene without each of its ingredients: what that changes
"""

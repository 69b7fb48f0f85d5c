"""Studies: many runs of one scene.

alone      a scene's tables with one of its rocks
compare    every rock alone, for several seeds, with plain Coulomb as well
strength   how much weaker the joints may be, and the critical tilt
ablate     a scene without each of its ingredients: what that changes
"""

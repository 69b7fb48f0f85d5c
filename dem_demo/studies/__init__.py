"""Studies: many runs of one scene.

compare    every rock alone, for several seeds, with plain Coulomb as well
strength   the factor of safety and the critical tilt
trials     what such a search has found, kept in a file
failure    how a scene fails: a run and its picture
ablate     a scene without each of its ingredients: what that changes
"""

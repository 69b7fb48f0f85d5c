"""Studies: many runs of one scene.

compare           every rock alone, for several seeds, with its own laws and with Coulomb's law
strength          factor of safety, critical tilt, and a run to failure
limit_analysis    an upper bound of the factor of safety
ablate            a scene without each of its ingredients: changes of the results, and of the cost
"""

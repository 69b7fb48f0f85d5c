"""Laboratory tests on a joint, in the order in which measured curves become a law.

    priors          what is known before: transforms, bounds, 95 % ranges
    forward         parameters to a law and its closure curve, and back
    measured        closure and shear curves, their misfit, and their noise from its scatter
    datasets        tests in text files: those of the package, in data/, and of laboratories
    problem         what is free, what is held, where to start; least squares with priors
    fit             fit_closure, fit_curves; their result: law, parameters, intervals,
                    what the data leave open, words, a picture

Each file imports from those above it only.
"""

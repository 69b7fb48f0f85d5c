"""Laboratory tests on a joint, in the order in which measured curves become a law.

    datasets        closure tests in files: those of the package, in data/, and CSV files
    priors          what is known before: transforms, bounds, 95 % ranges
    forward         parameters to a law and its closure curve, and back
    measured        closure and shear curves, their misfit, and their noise from its scatter
    problem         what is free, what is held, where to start; least squares with priors
    estimate        parameters, intervals, predicted stresses and bands; what the data leave open
    fit             fit_closure, fit_shear, fit_curves, fit_many; their result in words,
                    as a preset, and as a picture
    baselines       empirical closure laws to judge a fit by
    unloading       what friction explains of a measured loop

Each file imports from those above it only.
"""

"""Laboratory tests on a joint, in the order in which measured curves become a law.

    columns         tables of numbers as laboratories write them, with their units
    datasets        closure and shear tests in files: those of the package, in data/, and CSV files
    priors          what is known before: transforms, bounds, 95 % ranges
    forward         parameters to a law and its closure curve, and back
    measured        closure and shear curves, their misfit, and their noise from its scatter
    problem         what is free, what is held, where to start; least squares with priors
    starts          where a fit of closure and shear together begins
    estimate        parameters, intervals, predicted stresses and bands; what the data leave open
    shear_report    shear curves against the fitted law, in words and pictures
    fit             fit_closure, fit_shear, fit_curves, fit_many; their result in words,
                    as a preset, and as a picture
    baselines       empirical closure laws to judge a fit by
    unloading       what friction explains of a measured loop

Each file imports from those above it only.
"""

"""Laboratory tests on a joint, in the order in which measured curves become a law.

    priors          what is known before: transforms, bounds, 95 % ranges
    forward         parameters to a law and its closure curve, and back
    noise           expected levels of noise, and those that the scatter shows
    shearing        shear tests by a law, all joints together
    measured        closure and shear curves, and their misfit
    tables          columns of text files and spreadsheets, and rows that are no measurement
    datasets        tests in files: those of the package, in data/, and of laboratories
    envelopes       Coulomb, Barton, a power law, through the same tests
    problem         what is free, what is held, where to start; least squares with priors
    estimates       what a fit found: law, intervals, what the data leave open
    fit             fit_curves; its result in words and a picture
    field           a law from JRC, JCS, a friction angle and a stiffness

Each file imports from those above it only.
"""

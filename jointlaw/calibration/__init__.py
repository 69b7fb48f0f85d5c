"""Laboratory tests on a joint: from measured curves to a law.

    priors          prior knowledge: transforms, bounds, 95 % ranges
    forward         from parameters to a law and its closure curve, and back
    noise           expected noise levels, and levels estimated from residuals
    shearing        simulated shear tests, all joints of a fit in one batch
    measured        closure and shear curves, and their residuals
    tables          columns of text files and spreadsheets, and outliers
    datasets        tests in files: the data sets of the package (data/), and laboratory files
    envelopes       Coulomb, Barton and a power law fitted to the same tests
    problem         free and fixed parameters, initial values; least squares with priors
    estimates       the result: law, intervals, parameters not identifiable
    comparison      measured points beside the law and its band: counts, CSV, quality of a fit
    meaning         spacing of asperities, closure, stiffness and contact of a law
    fit             fit_curves; report and figure of the result
    field           a law from JRC, JCS, a friction angle and a stiffness

Each file imports only from the files above it.
"""

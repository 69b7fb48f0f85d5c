"""Measurements of a joint, and what they say of its law: tests, scans, and the fits through them.

Tests (closure and shear curves), in the order a value passes:

    curve_files   CSV files of closure curves: columns and units
    datasets      curves that come with the package, in data/
    measured      a curve with its noise, and what the law says of it
    priors        what is known before: scales, bounds, 95 % ranges
    noise         how noisy a curve is, from its scatter
    solve         least squares with priors and noise
    calibrate     fit_closure, fit_shear, fit_curves
    fit           the result: law, parameters, covariance, bands
    identify      what the data fix and what they leave open
    fit_report    a fit in words and as a preset
    fit_plot      pictures of fits and of scans
    sweep         many fits at once
    baselines     empirical closure laws to judge a fit by
    unloading     what friction explains of a measured loop
    fit_command   `jointlaw fit`

Scans (measured heights of a surface):

    scan_files    files of heights
    asperities    summits and facets of a surface
    height_fit    a gamma distribution through summit depths
    direction_fit Eq. 14 through facet slopes
    surface       from_surface, and the law it gives
    scan_report   a scan in words
    scan_command  `jointlaw scan`
    synthetic     surfaces whose asperities are known
"""

"""Scans of joint surfaces, in the order in which heights become a law.

    scan_files      files of heights: CSV, NPY, profilometers
    synthetic       surfaces whose asperities are known, to try a scan on
    asperities      summits and facets of a surface
    densities       gamma heights through summit depths, Eq. 14 through facet slopes
    estimate        parameters with errors, and what the scan leaves open
    fit             from_surface and its result: a law, words and a picture

Each file imports from those above it only.
"""

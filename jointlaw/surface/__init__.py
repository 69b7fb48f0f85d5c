"""Scans of joint surfaces, in the order in which heights become a law.

    scan_files      matrices of heights in text and NPY files
    asperities      summits and facets of a surface
    densities       gamma heights through summit depths, moments of Eq. 14 through facet slopes
    roughness       rms slopes of scans and of Eq. 14, spikes
    fit             from_surface and its result: a law, what the scan leaves open, words, a picture

Each file imports from those above it only.
"""

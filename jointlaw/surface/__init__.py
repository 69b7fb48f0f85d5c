"""Scans of joint surfaces: from heights to the parameters of a law.

    scan_files      matrices of heights in text and NPY files
    asperities      summits and facets of a surface
    densities       gamma heights fitted to summit depths, Eq. 14 fitted to facet slopes
    roughness       rms slopes of scans and of Eq. 14, spikes
    picture         the surface with its summits, inclinations by direction, depths
    faces           two scanned faces of a joint: mirrored, aligned, added
    fit             from_surface and its result: law, report, parameters that are not identifiable

Each file imports only from the files above it.
"""

"""Finite elements: the law as a behaviour of MGIS and as a UMAT, and its export.

export      header, tables, both sources, and what runs them in OpenGeoSys and Kratos, in one folder
files       those files, as they are copied
"""

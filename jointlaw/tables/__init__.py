"""Joint tables: the virgin response of a law against closure, for hosts that take no law.

table       the table, its interpolation, its files and its picture, and what it drops of the law
tabulate    from a law to its table
table_law   the law that a host runs from a table; a file of its own that hosts copy
"""

"""Joint tables: the first loading of a law against closure, for hosts that take no law.

joint_table   the table: interpolation, the force that a host takes from it, its file, and its
              error against the law; a file of its own, which hosts copy
tabulate      from a law to its table
"""

"""Joint tables: the first loading of a law against closure, for hosts that cannot call a law.

joint_table   the table: interpolation, traction of a host that uses it, its file, and its error
              against the law; it imports numpy alone, so that hosts copy it
tabulate      computes the table of a law
"""

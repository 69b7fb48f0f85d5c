"""Work on joint tables; the table itself, and its files, are in `jointlaw.table`.

tabulate    from a law to its table
report      what a table drops: its error against the law, by path
plot        picture of a table
"""

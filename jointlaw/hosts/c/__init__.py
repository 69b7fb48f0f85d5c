"""C and C++: the law as one header, and its export."""

"""A file for each program: what it can do, how it is told, run and read."""

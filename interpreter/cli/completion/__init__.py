"""Shell completion: `candidates.py` lists the possible next words of a command line.

The scripts in this folder call it from each shell.
"""

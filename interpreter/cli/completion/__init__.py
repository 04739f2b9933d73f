"""Shell completion: `candidates.py` lists the possible next words, and scripts in this folder query it from each shell."""

"""Shell completion: `candidates.py` lists the possible next words; scripts in this folder query it from each shell."""

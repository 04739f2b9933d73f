"""softmark from Python: what `import softmark` offers, its arguments, results that show themselves, and the magic.

Imports every room but `cli`. `api.py` loads and runs; `shown.py` is what a run gives, with its frame and its plots, a
file each; `extras.py` says what is missing and how to get it.
"""

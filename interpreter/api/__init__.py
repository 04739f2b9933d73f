"""softmark from Python: what `import softmark` offers, its arguments, results that show themselves, and the magic.

Imports every room but `cli`. `python_api.py` loads and runs; `shown_report.py` is what a run gives, with its frame and
its plots, a file each; `optional_packages.py` says what is missing and how to get it.
"""

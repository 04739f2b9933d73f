"""Python interface of softmark, with results for notebooks, pandas and matplotlib.

This package may import every package except `cli`. `python_api.py` loads and runs scenes. `shown_report.py` is the
result of a run; its table and its plots are in separate files. `optional_packages.py` reports missing packages.
"""

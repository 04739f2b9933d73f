"""Python interface of softmark: what `import softmark` offers, with results for notebooks, pandas and matplotlib.

It may import every package except `cli`. `python_api.py` loads and runs scenes; `shown_report.py` is the result of a
run, with its table and plots in a file each; `optional_packages.py` reports missing packages.
"""

"""Command line `dsl`: one file for each command, shell completion, plugin conformance, and signals.

No other package imports this one.
"""

"""Command line `dsl`: commands, shell completion, conformance tests of plugins, and signal handling.

Each command has a file of its own in `commands`. No other package imports this one.
"""

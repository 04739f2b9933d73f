"""The commands of `dsl`, a file each: `arguments(parser)` declares its options, `run(parsed)` gives the exit status.

To add a command: one file here, one line in COMMANDS of `main.py`.
"""

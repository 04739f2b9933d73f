"""Commands of `dsl`, one file each: `arguments(parser)` declares the options, `run(parsed)` returns the exit status.

To add a command: one file here, and one line in COMMANDS of `main.py`.
"""

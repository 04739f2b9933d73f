"""Commands of `dsl`, one file for each command.

Each file has two functions: `arguments(parser)` declares the options, and `run(parsed)` returns the exit status. To add
a command, write one file here and one line in COMMANDS of `main.py`.
"""

"""What could stand next on a command line: `answers` says it, and the scripts beside it ask it for each shell."""

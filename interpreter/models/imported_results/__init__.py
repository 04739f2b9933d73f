"""Models that were solved elsewhere: what a file tells, matched to a body."""

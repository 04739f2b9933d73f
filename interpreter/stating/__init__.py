"""What the errors that a model states are made of: other solutions, and what they may cost."""

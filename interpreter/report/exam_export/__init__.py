"""A scene as an examination for others: what they solve, and the sheet that says how they are judged."""

"""Models that other programs solve: what they are told, how they are run, and what they answer."""

"""Static equilibrium: Newton's method, paths by their length, stability, recovery from any state."""

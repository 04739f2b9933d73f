"""Static equilibrium: Newton's method, load stepping, arc length, stability, and recovery from perturbed states."""

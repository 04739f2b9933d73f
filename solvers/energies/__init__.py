"""Energies of solids, rods and springs over plain arrays: value, gradient, Hessian of each. To add one: `energy.Energy`."""

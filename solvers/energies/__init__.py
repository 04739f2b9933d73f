"""Energies of solids, rods and springs over plain arrays: value, gradient, Hessian. To add one: see `energy.Energy`."""

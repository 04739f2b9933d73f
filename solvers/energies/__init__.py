"""Energies of solids, rods, springs and loads over plain arrays: value, gradient, Hessian (`energy.Energy`)."""

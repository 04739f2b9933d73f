"""Energies of solids, rods, springs and loads over plain arrays: value, gradient and Hessian of each (`energy.Energy`)."""

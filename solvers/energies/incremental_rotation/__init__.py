"""Energies over unknowns that turn, rotation vectors from where a step of time has begun: `rods`, their `kernels`."""

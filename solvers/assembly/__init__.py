"""Energies over shared degrees of freedom: sums, patterns, with pressures, in single precision."""

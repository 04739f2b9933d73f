"""Linear systems: which factorisation, with pressures, one after the other with one pattern."""

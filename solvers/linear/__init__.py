"""Linear systems: choice of solver, factorisations, saddle points, and sequences of systems with one pattern."""

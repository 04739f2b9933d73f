"""Assembly of energies over shared degrees of freedom: sums, sparsity patterns, mixed elements, single precision."""

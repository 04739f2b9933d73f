"""Reduced models: displacements x = V q, with few unknowns q and a matrix V of displacement fields computed once.

reduced_basis     fields: vibration modes, static responses, modal derivatives, principal fields of training states
cell_energies     energies split into single cells, and restricted to chosen cells
hyperreduction    selection and weights of a few cells that represent all cells (ECSW)
projected_energy  energies as functions of q, solved by the same statics and dynamics as full models
reduction_error   error of a reduced model from the residual of the full equations
basis_products    products with V in one thread
"""

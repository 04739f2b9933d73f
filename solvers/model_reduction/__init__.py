"""Reduced models: displacements x = V q in a space of a few fields V, computed once, with few unknowns q to solve for.

reduced_basis     fields: vibration modes, static responses, modal derivatives, principal fields of training states
cell_energies     energies split into cells, and restricted to chosen cells
hyperreduction    selection and weights of the cells that represent all (ECSW)
projected_energy  energies of q, solved by the same statics and dynamics as any other
reduction_error   error of a reduced model from the residual of the full equations
basis_products    products with V in one thread
"""

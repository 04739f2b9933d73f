"""Rod energies in incremental rotation vectors, counted from the start of the current time step (dynamics).

- moving_rods: strain energy, dead loads and the rotation chart
- moving_rod_kernels: compiled loops over elements
- moving_rod_joints: rods that share joints
- moving_rod_loads: concentrated moments, and tendons through guides
- moving_rod_tendons: tendons along the rod
"""

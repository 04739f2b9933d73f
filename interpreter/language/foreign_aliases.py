"""Names of other programs for fields, choices and constructors of this language; suggested, but never accepted."""

from __future__ import annotations

from softmark.grammar.diagnostic import Fix, Remedy

# Names of our fields in other programs: suggested, never accepted.
SYNONYMS = {
    "E": "young", "youngs_modulus": "young", "young_modulus": "young", "youngModulus": "young",
    "youngs": "young", "modulus": "young", "stiffness": "young", "elastic_modulus": "young",
    "nu": "poisson", "poissons_ratio": "poisson", "poisson_ratio": "poisson", "poissonRatio": "poisson",
    "v": "poisson",
    "rho": "density", "mass_density": "density", "totalMass": "density", "total_mass": "density",
    "mass": "density",
    "L": "length", "len": "length", "height": "length", "r": "radius", "R": "radius", "diameter": "radius",
    "h": "size", "mesh_size": "size", "resolution": "size", "element_size": "size", "lc": "size",
    "elements": "segments", "n": "segments", "nb": "segments", "divisions": "segments", "nodes": "segments",
    "tol": "tolerance", "threshold": "tolerance", "eps": "tolerance", "maxiter": "max_iterations",
    "iterations": "max_iterations", "max_iter": "max_iterations",
    "on": "where", "region": "where", "indices": "where", "box": "where", "selection": "where", "at_": "at",
    "position": "at", "force": "vector", "value": "vector", "g": "magnitude", "acceleration": "magnitude",
    "dir": "direction", "start": "from", "end": "to", "begin": "from", "samples": "points", "count": "points",
    "reference": "against", "ref": "against", "method": "strain", "formulation": "strain",
    "kinematics": "strain",
    "fixed": "components", "dofs": "components", "filename": "path", "file": "path", "scale": "unit",
    "extents": "size", "dimensions": "size", "center": "origin", "centre": "origin",
    "dt": "step", "delta_t": "step", "time_step": "step", "timestep": "step", "h_t": "step",
    "t_end": "duration", "end_time": "duration", "total_time": "duration", "final_time": "duration",
    "time": "duration", "T": "duration", "scheme": "integrator", "time_integration": "integrator",
    "time_integrator": "integrator", "rayleigh_mass": "damping_mass", "rayleigh_stiffness": "damping_stiffness",
    "rayleighMass": "damping_mass", "rayleighStiffness": "damping_stiffness", "alpha": "damping_mass",
    "beta": "damping_stiffness", "rho_inf": "spectral_radius", "rho_infinity": "spectral_radius",
    "initial_velocity": "velocity", "angular_velocity": "spin", "omega": "spin",
    "duration": "over", "rise_time": "over", "ramp_time": "over", "stop": "until",
    "curve": "amplitude", "history": "amplitude", "schedule": "amplitude", "load_curve": "amplitude", "f": "frequency",
    "k": "stiffness", "spring_constant": "stiffness", "spring_stiffness": "stiffness", "topology": "network",
    "cells": "network", "quadrature": "integration", "gauss_points": "integration", "lumping": "mass",
    "mass_matrix": "mass", "units": "unit", "length_unit": "unit", "accuracy": "uncertainty",
    "precision": "uncertainty", "error": "uncertainty", "registration": "register", "align": "register",
    "isovalue": "iso", "iso_value": "iso", "level": "iso", "voxel_size": "voxel", "psf": "blur",
    "models": "of", "model": "of", "frame": "state", "fps": "rate", "refresh": "rate", "hz": "rate",
    "C10": "c1", "C1": "c1", "c10": "c1", "C01": "c2", "C2": "c2", "c01": "c2", "C20": "c2", "C30": "c3",
    "K": "bulk", "kappa": "bulk", "bulk_modulus": "bulk", "Jm": "limit", "J_m": "limit", "lambda_m": "limit",
    "lambda_L": "limit", "volume": "volumetric",
    "linear_solver": "linear", "cg_iterations": "max_linear_iterations", "warm_start": "initial_guess",
    "dtype": "precision", "factorization": "factorisation",
    "statistics": "statistic", "norm": "statistic", "citation": "source", "parameter": "target", "variable": "target",
    "values": "over", "range": "over", "sweep": "over", "product": "with", "times": "with",
}  # fmt: skip

# Names of similar but different quantities: their numbers cannot be used directly.
CONVERTED = {
    "diameter": "half the diameter", "mass": "mass divided by volume", "total_mass": "mass divided by volume",
    "totalMass": "mass divided by volume",
    "center": "not the middle of the shape", "centre": "not the middle of the shape",
}  # fmt: skip

# Names of the choices of a field in other programs.
CHOICES = {
    "linear": "small", "infinitesimal": "small", "small_strain": "small", "engineering": "small",
    "corotated": "corotational", "co_rotational": "corotational", "polar": "corotational",
    "large": "corotational",
    "svd": "corotational", "qr": "corotational", "nonlinear": "finite", "green_lagrange": "finite",
    "total_lagrangian": "finite", "hyperelastic": "finite", "finite_strain": "finite",
    "backward_euler": "implicit_euler", "euler_implicit": "implicit_euler", "euler": "implicit_euler",
    "implicit": "implicit_euler", "average_acceleration": "newmark", "newmark_beta": "newmark",
    "crank_nicolson": "trapezoidal", "trapezoid": "trapezoidal", "trapezium": "trapezoidal",
    "hht": "generalized_alpha", "hht_alpha": "generalized_alpha", "wbz": "generalized_alpha",
    "generalised_alpha": "generalized_alpha", "chung_hulbert": "generalized_alpha",
    "bdf": "bdf2", "gear": "bdf2", "implicit_midpoint": "midpoint", "midpoint_rule": "midpoint",
    "variational": "midpoint", "verlet": "central_differences", "leapfrog": "central_differences",
    "explicit": "central_differences", "central_difference": "central_differences",
    "symplectic_euler": "central_differences", "semi_implicit_euler": "central_differences",
    "reduced": "selective", "sri": "selective", "b_bar": "mean_dilatation", "bbar": "mean_dilatation",
    "fbar": "mean_dilatation", "f_bar": "mean_dilatation", "F_bar": "mean_dilatation", "q1p0": "mean_dilatation",
    "u_p": "mixed", "up": "mixed", "hybrid": "mixed", "taylor_hood": "mixed", "herrmann": "mixed",
    "p2p1": "mixed", "three_field": "mixed", "standard": "displacement", "gauss": "full", "exact": "full",
    "diagonal": "lumped", "row_sum": "lumped", "equal": "uniform", "per_element": "element", "cell": "element",
    "average": "mean", "std": "sd", "stdev": "sd", "standard_deviation": "sd", "maximum": "max", "rmse": "rms",
    "root_mean_square": "rms", "closest": "nearest", "closest_point": "nearest", "normals": "normal",
    "projected": "normal", "iterative_closest_point": "icp", "held": "clamp",
    "biggest": "largest", "face": "faces", "body": "all", "tetrahedra": "tet4", "hexahedra": "hex8",
    "freudenthal": "kuhn", "float32": "single", "float64": "double", "fp32": "single", "fp64": "double",
    "cg": "conjugate_gradients", "pcg": "conjugate_gradients", "amg": "multigrid", "lu": "superlu", "llt": "cholesky",
    "ldlt": "cholesky", "direct": "cholesky", "mkl": "pardiso",
}  # fmt: skip

# Names of elements in other programs.
CELLS = {
    "brick": "hex8", "hexahedron": "hex8", "hexahedra": "hex8", "hexa": "hex8", "hex": "hex8", "cube": "hex8",
    "C3D8": "hex8", "H8": "hex8", "Q1": "hex8", "hexahedron8": "hex8", "tetra10": "tet10", "tetrahedron10": "tet10",
    "quadratic": "tet10", "quadratic_tet": "tet10", "C3D10": "tet10", "P2": "tet10", "T10": "tet10",
    "tetrahedron": "tet4", "tetra": "tet4", "tetrahedra": "tet4", "tet": "tet4", "C3D4": "tet4", "P1": "tet4",
    "T4": "tet4", "C3D20": "hex20", "H20": "hex20", "hexahedron20": "hex20", "serendipity": "hex20", "C3D27": "hex27",
    "H27": "hex27", "Q2": "hex27", "hexahedron27": "hex27", "triquadratic": "hex27", "quadratic_hex": "hex27",
    "triangle": "tri3", "triangle3": "tri3", "CST": "tri3", "CPE3": "tri3", "CPS3": "tri3", "CAX3": "tri3",
    "triangle6": "tri6", "LST": "tri6", "CPE6": "tri6", "CPS6": "tri6", "CAX6": "tri6",
    "quad": "quad4", "CPE4": "quad4", "CPS4": "quad4", "CAX4": "quad4", "CPE8": "quad8", "CPS8": "quad8",
    "CAX8": "quad8",
}  # fmt: skip

# Words for directions, which depend on the view of a scene.
DIRECTIONS = {
    "down": "gravity usually pulls along `-z`", "up": "often `+z`", "left": "such as `-x`",
    "right": "such as `+x`",
    "forward": "such as `+y`", "back": "such as `-y`", "X": "write `x`", "Y": "write `y`", "Z": "write `z`",
}  # fmt: skip

# Material constants of other programs: suggested, never accepted.
MODULI = {
    "mu": "young = 2 * mu * (1 + poisson)", "G": "young = 2 * G * (1 + poisson)",
    "shear_modulus": "young = 2 * shear_modulus * (1 + poisson)", "C10": "young = 4 * C10 * (1 + poisson)",
    "c10": "young = 4 * c10 * (1 + poisson)", "K": "young = 3 * K * (1 - 2 * poisson)",
    "bulk_modulus": "young = 3 * bulk_modulus * (1 - 2 * poisson)", "D1": "poisson = 0.5 - young * D1 / 12",
    "lambda": "poisson = lambda / (2 * (lambda + mu))", "lam": "poisson = lam / (2 * (lam + mu))",
}  # fmt: skip

# Functions of other languages.
FUNCTIONS: dict[str, str | Remedy] = {
    "pow": "write `a^b`", "power": "write `a^b`", "ln": Remedy("`log` is the natural logarithm", Fix("log")),
    "log10": "write `log(a) / log(10)`",
    "cbrt": "write `a^(1 / 3)`", "square": "write `a^2`", "fabs": Remedy("write `abs(a)`", Fix("abs")),
    "norm": "take the root of a sum of squares",
    "asin": "", "acos": "", "atan": "", "atan2": "", "sinh": "", "cosh": "", "tanh": "", "floor": "",
    "ceil": "", "round": "",
    "rad": "write `30 deg`: angles have units", "radians": "write `30 deg`: angles have units",
    "degrees": "write `30 deg`: angles have units",
}  # fmt: skip

# Remedies for a field out of range: (field, whether it is too large).
ADVICE = {
    ("magnitude", False): "a magnitude is not negative; `direction` sets the way it pulls",
    ("poisson", True): "at 0.5 a solid keeps its volume; above 0.5 its volume would grow under pressure",
    ("poisson", False): "Poisson's ratio is above -1, and between 0 and 0.5 for almost every solid",
}

# Names of our constructors and kinds in other programs.
WORDS = {
    **CELLS,
    "neohookean": "neo_hookean", "NeoHookean": "neo_hookean", "neohooke": "neo_hookean",
    "mooney": "mooney_rivlin", "MooneyRivlin": "mooney_rivlin", "eight_chain": "arruda_boyce", "fung_demiray": "fung",
    "demiray": "fung", "veronda": "veronda_westmann", "exponential": "fung", "balloon": "inflation",
    "StVK": "st_venant_kirchhoff",
    "stvk": "st_venant_kirchhoff", "svk": "st_venant_kirchhoff",
    "saint_venant_kirchhoff": "st_venant_kirchhoff",
    "hooke": "linear_elastic", "elastic": "linear_elastic", "linear": "linear_elastic",
    "isotropic": "linear_elastic",
    "springs": "mass_spring", "msm": "mass_spring", "spring_network": "mass_spring",
    "beam": "beam6dof", "rod": "beam6dof", "cosserat": "beam6dof", "cube": "box", "brick": "box", "block": "box",
    "cuboid": "box", "ball": "sphere",
    "rod_shape": "cylinder", "clamp": "fixed", "fix": "fixed", "dirichlet": "displaced",
    "encastre": "fixed", "body_force": "gravity", "weight": "gravity", "neumann": "traction",
    "prescribed": "displaced", "displacement_bc": "displaced", "l2": "relative_l2_error",
    "l2_norm": "relative_l2_error",
    "timoshenko": "simo_reissner", "reissner": "simo_reissner", "euler_bernoulli": "small_deflection",
    "real_time": "realtime_factor", "hausdorff_distance": "hausdorff", "mae": "mean_error",
    "object": "body", "boundary": "support", "constraint": "support", "bc": "support",
    "force_": "load", "solver": "analysis", "simulation": "analysis", "method": "model", "measure": "metric",
    "error": "metric", "geometry": "shape", "let": "param", "parameter": "param", "const": "param",
    "var": "param",
    "import": "use", "include": "use", "assert": "expect", "check": "expect", "observable": "probe",
    "transient": "dynamic", "time_history": "dynamic", "implicit_dynamic": "dynamic",
    "rom": "pod", "reduced_order": "pod", "eigenmodes": "modal",
    "grid_convergence": "self_converged",
    "quasi_static": "quasistatic", "equilibrium": "static", "steady": "static",
    "mass_springs": "mass_spring", "spring_mass": "mass_spring", "spring_damper": "mass_spring",
    "van_gelder": "from_material", "auto": "from_material", "fitted": "calibrated", "fit": "calibrated",
    "tuned": "calibrated", "optimised": "calibrated", "optimized": "calibrated", "constant": "uniform",
    "stl": "surface", "obj": "surface", "ply": "surface", "scan": "surface", "laser_scan": "surface",
    "ct_scan": "ct_volume", "ct": "ct_volume", "dicom": "ct_volume", "nrrd": "ct_volume",
    "nifti": "ct_volume", "voxels": "ct_volume", "beads": "markers", "landmarks": "markers",
    "fiducials": "markers", "tracked_points": "markers", "synthetic_scan": "virtual_scan",
    "virtual_ct": "virtual_scan", "vertices": "mesh_nodes", "interior": "volume", "skin": "surface",
    "tracked": "measured_motion", "imposed": "displaced",
    "mean_distance": "surface_distance", "surface_error": "surface_distance", "frame_rate": "realtime_factor",
    "mean_absolute_error": "mean_error", "volume_loss": "volume_change", "volume_ratio": "volume_change",
    "eigenfrequency": "frequency", "natural_frequency": "frequency",
    "strain_error": "energy_norm_error", "linear_ramp": "ramp", "smoothstep": "smooth", "cosine": "sine",
    "sinusoid": "sine", "impulse": "pulse", "experiment": "reference", "measurement": "reference",
    "ground_truth": "reference", "truth": "reference", "paper": "published",
    "known_value": "values", "literature": "values", "literature_value": "values", "benchmark_value": "values",
    "parameter_study": "sweep", "grid": "sweep", "vary": "sweep", "refinement": "sweep", "richardson": "convergence",
    "gci": "convergence", "order": "convergence", "front": "pareto", "trade_off": "pareto", "tradeoff": "pareto",
    "limits": "robustness", "extremes": "robustness",
}  # fmt: skip

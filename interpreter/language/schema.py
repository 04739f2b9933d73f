"""The vocabulary: what each constructor of the language is called, and what its fields may hold.

Nothing is written twice: a constructor is a frozen dataclass, registered in one of the tables below, whose
annotations `Annotated[type, "UNIT in RANGE" or "KIND", "meaning"]` say all that checking, `dsl explain`,
completion and the report need. To add a constructor: one class, one line in the table of its package.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cache, lru_cache
from importlib import import_module
from typing import Any, Literal, get_args, get_origin, get_type_hints

from softmark.interpreter.language import units
from softmark.interpreter.language.units import Dimension
from softmark.records import dataclass

Form = Literal[
    "quantity", "vector", "integer", "flag", "choice", "text", "file", "direction", "condition", "components",
    "name", "names", "list", "value", "target", "targets", "variants"
]


@dataclass(frozen=True)
class Interval:
    """A range in SI, with open or closed ends."""

    low: float
    high: float
    low_open: bool
    high_open: bool

    def __contains__(self, value: float) -> bool:
        above = value > self.low if self.low_open else value >= self.low
        return above and (value < self.high if self.high_open else value <= self.high)

    def words(self, dimension: Dimension) -> str:
        """`greater than 0`, `between -1 and 0.5 (exclusive)`."""
        low, high = (_bound(v, dimension) for v in (self.low, self.high))
        if self.high == float("inf"):
            return f"{'greater than' if self.low_open else 'at least'} {low}"
        if self.low == -float("inf"):
            return f"{'less than' if self.high_open else 'at most'} {high}"
        ends = {(True, True): ", both excluded", (False, False): ", both included"}
        one = f", {low if self.low_open else high} excluded"
        return f"between {low} and {high}{ends.get((self.low_open, self.high_open), one)}"


def _bound(value: float, dimension: Dimension) -> str:
    return "0" if value == 0 else units.show(value, dimension)


@dataclass(frozen=True)
class Field:
    """One field of a constructor, as the language sees it."""

    name: str  # as scenes write it
    attribute: str  # as Python has it: `from_` for `from`
    form: Form
    doc: str
    required: bool
    default: Any
    dimension: Dimension | None = None
    interval: Interval | None = None
    options: tuple[str, ...] = ()  # of a choice
    kind: str = ""  # of a name: `body`; of a value: `material`
    also: tuple[str, ...] = ()  # further kinds that a name may be of
    folder: bool = False  # whether a file may be a folder

    @property
    def expected(self) -> str:
        """What may stand here, for messages: `a pressure`, `small, corotational or finite`."""
        if self.form in ("quantity", "vector") and self.dimension is not None:
            one = units.named(self.dimension)
            return one if self.form == "quantity" else f"three components, each {one}"
        if self.form == "choice":
            *others, last = self.options
            return f"{', '.join(others)} or {last}" if others else last
        if self.form == "names":
            return f"a list of {plural(self.kind)} such as `[a, b]`"
        return _EXPECTED.get(self.form) or f"{article(self.kind)} {self.kind}"

    @property
    def meaning(self) -> str:
        """The field and what it stands for, for messages."""
        joint = " is" if re.match(r"(the|whether|how|which|where|what|[A-Z]\S*) ", self.doc) else ":"
        return f"`{self.name}`{joint} {self.doc}"


_EXPECTED = {
    "integer": "a whole number",
    "flag": "yes or no",
    "text": "a text in double quotes",
    "file": "a file name in double quotes",
    "direction": "a direction such as `-z` or `(0, 0, -1)`",
    "condition": "a condition on the coordinates, such as `x <= 0 mm`",
    "components": "components such as `x` or `(x, y)`",
    "list": "a list of values such as `[10, 5, 2.5] mm`",
    "target": "the name of a parameter, such as `h`, or of a field, such as `rod.segments`",
    "targets": "a list of parameters and fields such as `[h, gel.poisson]`",
    "variants": "a list of values such as `[10, 5, 2.5] mm`",
}


def article(word: str) -> str:
    """`a` or `an`."""
    return "an" if word[:1] in "aeiou" else "a"


def plural(kind: str) -> str:
    """`materials`, `bodies`, `analyses`."""
    return _PLURALS.get(kind, f"{kind}s")


_PLURALS = {
    "body": "bodies", "analysis": "analyses", "published": "published values", "stiffness": "stiffnesses",
    "study": "studies",
}  # fmt: skip


def listed(names: Sequence[str], most: int = 12) -> str:
    """Names for a message, which says how many more there are."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


@dataclass(frozen=True)
class Constructor:
    """A word of the vocabulary: its class, its kind and its fields in order."""

    name: str
    kind: str
    cls: type[Any]
    fields: tuple[Field, ...]

    @property
    def summary(self) -> str:
        """The first line of the class's documentation."""
        return (self.cls.__doc__ or "").strip().split("\n")[0]

    def field(self, name: str) -> Field | None:
        """The field that scenes call `name`."""
        return next((f for f in self.fields if f.name == name), None)


_PLACES = {  # kind of declaration: its module and the table there; in the order in which `dsl list` shows them
    "shape": ("solvers.mesh.shapes", "SHAPES"),
    "material": ("solvers.materials", "MATERIALS"),
    "body": ("interpreter.vocabulary", "BODIES"),
    "support": ("interpreter.vocabulary", "SUPPORTS"),
    "load": ("interpreter.vocabulary", "LOADS"),
    "analysis": ("interpreter.vocabulary", "ANALYSES"),
    "model": ("interpreter.models", "MODELS"),
    "reference": ("references", "REFERENCES"),
    "probe": ("interpreter.vocabulary", "PROBES"),
    "metric": ("interpreter.metrics", "METRICS"),
    "published": ("interpreter.vocabulary", "PUBLISHED"),
    "course": ("interpreter.vocabulary", "COURSES"),
    "stiffness": ("interpreter.models.springs.words", "STIFFNESSES"),
    "study": ("interpreter.vocabulary", "STUDIES"),
}


class Tables(Mapping[str, Mapping[str, type[Any]]]):
    """Kind of declaration -> constructors: all that a scene can declare; a table is imported when it is asked for."""

    def __getitem__(self, kind: str) -> Mapping[str, type[Any]]:
        module, table = _PLACES[kind]
        found: Mapping[str, type[Any]] = getattr(import_module(f"softmark.{module}"), table)
        return found

    def __contains__(self, kind: object) -> bool:  # of Mapping, it would import the table
        return kind in _PLACES

    def __iter__(self) -> Iterator[str]:
        return iter(_PLACES)

    def __len__(self) -> int:
        return len(_PLACES)


_TABLES = Tables()


def tables() -> Tables:
    """The vocabulary."""
    return _TABLES


@lru_cache(maxsize=1)
def words() -> dict[str, type[Any]]:
    """Constructors that take no arguments and stand as bare words: the elements."""
    from softmark.solvers.elements import ELEMENTS

    return dict(ELEMENTS)


@cache
def constructor(kind: str, name: str) -> Constructor | None:
    """The constructor `name` of a kind, or None."""
    cls = tables().get(kind, {}).get(name)
    return None if cls is None else Constructor(name, kind, cls, _fields(cls))


def find(name: str) -> list[Constructor]:
    """Every constructor with this name, whatever its kind."""
    found = (constructor(kind, name) for kind in tables())
    return [c for c in found if c is not None]


def _fields(cls: type[Any]) -> tuple[Field, ...]:
    hints = get_type_hints(cls, include_extras=True)
    described = (f for f in dataclasses.fields(cls) if get_origin(hints[f.name]) is not None)
    return tuple(_field(f, hints[f.name]) for f in described)


def _field(f: dataclasses.Field[Any], hint: Any) -> Field:
    base, *facts = get_args(hint)
    spec, doc = facts if len(facts) == 2 else ("", facts[0])
    required = f.default is dataclasses.MISSING
    made = _shape(base, spec)
    return Field(f.name.rstrip("_"), f.name, doc=doc, required=required,
                 default=None if required else f.default, **made)


def _shape(base: Any, spec: str) -> dict[str, Any]:
    """The form of a field from its type and its specification."""
    if get_origin(base) is Literal:
        return {"form": "choice", "options": get_args(base)}
    if base is bool:
        return {"form": "flag"}
    if spec in ("file", "file or folder"):
        return {"form": "file", "folder": spec == "file or folder"}
    if spec in ("direction", "condition", "components", "target", "targets", "variants"):
        return {"form": spec}
    if base is str and not spec:
        return {"form": "text"}
    if base is int or int in get_args(base):
        return {"form": "integer", "interval": _interval(spec)}
    if spec in ("shape", "material", "element", "course", "stiffness"):
        return {"form": "value", "kind": spec}
    if spec in ("body", "reference", "probe", "analysis", "metric", "model", "study"):
        return {"form": "name", "kind": spec}
    if spec == "reference or model":
        return {"form": "name", "kind": "reference", "also": ("model",)}
    if spec == "models":
        return {"form": "names", "kind": "model"}
    if spec == "values":
        return {"form": "list"}
    unit = spec.split(" in ")[0]
    vector = tuple in (get_origin(base), *(get_origin(part) for part in get_args(base)))
    form = "vector" if vector else "quantity"
    return {"form": form, "dimension": units.parse(unit).dimension, "interval": _interval(spec)}


_RANGE = re.compile(r"in ([(\[])(\S+), (\S+)([)\]])$")


def _interval(spec: str) -> Interval | None:
    match = _RANGE.search(spec)
    if match is None:
        return None
    return Interval(float(match[2]), float(match[3]), match[1] == "(", match[4] == ")")


# What other programs call our fields: suggested, never accepted.
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
    "duration": "over", "rise_time": "over", "ramp_time": "over", "stop": "until", "amplitude": "course",
    "curve": "course", "history": "course", "schedule": "course", "f": "frequency",
    "k": "stiffness", "spring_constant": "stiffness", "spring_stiffness": "stiffness", "topology": "network",
    "cells": "network", "quadrature": "integration", "gauss_points": "integration", "lumping": "mass",
    "mass_matrix": "mass", "units": "unit", "length_unit": "unit", "accuracy": "uncertainty",
    "precision": "uncertainty", "error": "uncertainty", "registration": "register", "align": "register",
    "isovalue": "iso", "iso_value": "iso", "level": "iso", "voxel_size": "voxel", "psf": "blur",
    "models": "of", "model": "of", "frame": "state", "fps": "rate", "refresh": "rate", "hz": "rate",
    "linear_solver": "linear", "cg_iterations": "linear_cap", "initial_guess": "start", "warm_start": "start",
    "dtype": "precision", "factorization": "factorisation",
    "statistics": "statistic", "norm": "statistic", "citation": "source", "parameter": "target", "variable": "target",
    "values": "over", "range": "over", "sweep": "over", "product": "with", "times": "with",
}  # fmt: skip

# What is near a field of ours and is another quantity: the number cannot be taken over.
CONVERTED = {
    "diameter": "half the diameter", "mass": "mass divided by volume", "total_mass": "mass divided by volume",
    "totalMass": "mass divided by volume",
    "center": "not the middle of the shape", "centre": "not the middle of the shape",
}  # fmt: skip

# What other programs call the choices of a field.
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

# What other programs call the elements.
CELLS = {
    "brick": "hex8", "hexahedron": "hex8", "hexahedra": "hex8", "hexa": "hex8", "hex": "hex8", "cube": "hex8",
    "C3D8": "hex8", "H8": "hex8", "Q1": "hex8", "hexahedron8": "hex8", "tetra10": "tet10", "tetrahedron10": "tet10",
    "quadratic": "tet10", "quadratic_tet": "tet10", "C3D10": "tet10", "P2": "tet10", "T10": "tet10",
    "tetrahedron": "tet4", "tetra": "tet4", "tetrahedra": "tet4", "tet": "tet4", "C3D4": "tet4", "P1": "tet4",
    "T4": "tet4",
}  # fmt: skip

# Words for directions, which depend on how one looks at a scene.
DIRECTIONS = {
    "down": "gravity usually pulls along `-z`", "up": "often `+z`", "left": "such as `-x`",
    "right": "such as `+x`",
    "forward": "such as `+y`", "back": "such as `-y`", "X": "write `x`", "Y": "write `y`", "Z": "write `z`",
}  # fmt: skip

# What other programs describe a material by: suggested, never accepted.
MODULI = {
    "mu": "young = 2 * mu * (1 + poisson)", "G": "young = 2 * G * (1 + poisson)",
    "shear_modulus": "young = 2 * shear_modulus * (1 + poisson)", "C10": "young = 4 * C10 * (1 + poisson)",
    "c10": "young = 4 * c10 * (1 + poisson)", "K": "young = 3 * K * (1 - 2 * poisson)",
    "bulk_modulus": "young = 3 * bulk_modulus * (1 - 2 * poisson)", "D1": "poisson = 0.5 - young * D1 / 12",
    "lambda": "poisson = lambda / (2 * (lambda + mu))", "lam": "poisson = lam / (2 * (lam + mu))",
}  # fmt: skip

# Functions of other languages.
FUNCTIONS = {
    "pow": "write `a^b`", "power": "write `a^b`", "ln": "`log` is the natural logarithm",
    "log10": "write `log(a) / log(10)`",
    "cbrt": "write `a^(1 / 3)`", "square": "write `a^2`", "fabs": "write `abs(a)`",
    "norm": "take the root of a sum of squares",
    "asin": "", "acos": "", "atan": "", "atan2": "", "sinh": "", "cosh": "", "tanh": "", "floor": "",
    "ceil": "", "round": "",
    "rad": "write `30 deg`: angles have units", "radians": "write `30 deg`: angles have units",
    "degrees": "write `30 deg`: angles have units",
}  # fmt: skip

# What helps where a field is out of its range: (field, whether it is too large).
ADVICE = {
    ("magnitude", False): "a magnitude is not negative; `direction` says where it pulls",
    ("poisson", True): "at 0.5 a solid keeps its volume whatever happens; beyond, it would grow when it is squeezed",
    ("poisson", False): "Poisson's ratio is above -1, and between 0 and 0.5 for almost every solid",
}

# What other programs call our constructors and kinds.
WORDS = {
    **CELLS,
    "neohookean": "neo_hookean", "NeoHookean": "neo_hookean", "neohooke": "neo_hookean",
    "StVK": "st_venant_kirchhoff",
    "stvk": "st_venant_kirchhoff", "svk": "st_venant_kirchhoff",
    "saint_venant_kirchhoff": "st_venant_kirchhoff",
    "hooke": "linear_elastic", "elastic": "linear_elastic", "linear": "linear_elastic",
    "isotropic": "linear_elastic",
    "springs": "mass_spring", "spring": "mass_spring", "msm": "mass_spring", "spring_network": "mass_spring",
    "beam": "beam6dof", "rod": "beam6dof", "cosserat": "beam6dof", "cube": "box", "brick": "box", "block": "box",
    "rod_shape": "cylinder", "tube": "cylinder", "clamp": "fixed", "fix": "fixed", "dirichlet": "displaced",
    "encastre": "fixed", "body_force": "gravity", "weight": "gravity", "neumann": "traction",
    "force": "point_force",
    "prescribed": "displaced", "displacement_bc": "displaced", "l2": "energy_norm", "l2_norm": "energy_norm",
    "timoshenko": "simo_reissner", "reissner": "simo_reissner", "euler_bernoulli": "small_deflection",
    "real_time": "realtime", "hausdorff_distance": "hausdorff", "rmse": "mean_error", "mae": "mean_error",
    "object": "body", "solid": "body", "boundary": "support", "constraint": "support", "bc": "support",
    "force_": "load", "solver": "analysis", "simulation": "analysis", "method": "model", "measure": "metric",
    "error": "metric", "geometry": "shape", "let": "param", "parameter": "param", "const": "param",
    "var": "param",
    "import": "use", "include": "use", "assert": "expect", "check": "expect", "observable": "probe",
    "transient": "dynamic", "time_history": "dynamic", "implicit_dynamic": "dynamic",
    "rom": "pod", "reduced_order": "pod", "eigenmodes": "modal",
    "grid_convergence": "self_converged",
    "quasi_static": "static", "equilibrium": "static", "steady": "static",
    "mass_springs": "mass_spring", "spring_mass": "mass_spring", "spring_damper": "mass_spring",
    "van_gelder": "from_material", "auto": "from_material", "fitted": "calibrated", "fit": "calibrated",
    "tuned": "calibrated", "optimised": "calibrated", "optimized": "calibrated", "constant": "uniform",
    "stl": "surface", "obj": "surface", "ply": "surface", "scan": "surface", "laser_scan": "surface",
    "ct_scan": "ct_volume", "ct": "ct_volume", "mri": "ct_volume", "dicom": "ct_volume", "nrrd": "ct_volume",
    "nifti": "ct_volume", "voxels": "ct_volume", "beads": "markers", "landmarks": "markers",
    "fiducials": "markers", "tracked_points": "markers", "synthetic_scan": "virtual_scan",
    "virtual_ct": "virtual_scan", "vertices": "nodes", "interior": "volume", "skin": "surface",
    "tracked": "follows", "imposed": "displaced", "chamfer": "surface_distance",
    "mean_distance": "surface_distance", "surface_error": "surface_distance", "frame_rate": "realtime",
    "mean_absolute_error": "mean_error", "volume_loss": "volume_change", "volume_ratio": "volume_change",
    "eigenfrequency": "period", "natural_frequency": "period", "trajectory_error": "course_norm",
    "strain_error": "strain_energy_norm", "linear_ramp": "ramp", "smoothstep": "smooth", "cosine": "sine",
    "sinusoid": "sine", "impulse": "pulse", "experiment": "reference", "measurement": "reference",
    "ground_truth": "reference", "truth": "reference", "paper": "published", "table": "published",
    "parameter_study": "sweep", "grid": "sweep", "vary": "sweep", "refinement": "sweep", "richardson": "convergence",
    "gci": "convergence", "order": "convergence", "front": "pareto", "trade_off": "pareto", "tradeoff": "pareto",
    "stress": "stability", "robustness": "stability", "limits": "stability", "extremes": "stability",
}  # fmt: skip

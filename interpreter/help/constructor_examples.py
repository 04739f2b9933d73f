"""Example calls of constructors, derived from the types of their fields."""

from __future__ import annotations

from softmark.interpreter.language import units
from softmark.interpreter.language.field_schema import Constructor, Field

_QUANTITIES = {
    units.PRESSURE: "60 kPa", units.LENGTH: "20 mm", (-3, 1, 0, 0, 0): "1070 kg/m^3", units.NONE: "0.3",
    (1, 0, -2, 0, 0): "9.81 m/s^2",
}  # fmt: skip
_VALUES = {
    "element": "tet4", "shape": "cylinder(length = 178 mm, radius = 19 mm)", "stiffness": "from_material()",
}  # fmt: skip
_FITTING = {  # values of fields that depend on another field, or accept only some shapes
    "one": "box(size = (20, 20, 5) mm)", "other": "sphere(radius = 8 mm)",
    "inner": "10 mm", "first": "(0, 0, 0) mm", "second": "(48, 44, 0) mm", "third": "(48, 60, 0) mm",
    "mesh": 'mesh("file.msh", unit = 1 mm)', "limit": "30", "alpha": "[1.3, 5]",
    "fourth": "(0, 44, 0) mm", "region": "quarter_ring(inner = 10 mm, outer = 20 mm)", "thickness": "1 mm",
    "outer_along": "30 mm", "rim": "5 mm", "rounding": "2 mm", "uncertainty": "0.05 mm", "sheets": "+y",
}  # fmt: skip
_FILES = {"tetrahedralized": '"file.stl"', "markers": '"file.csv"', "table": '"file.csv"', "ct_volume": '"file.nrrd"'}
_CHOSEN = {  # optional fields that examples set, because they are usually needed
    "arc": ("side",), "curve_error": ("over",), "network": ("radius",),
    "fem": ("size",), "mass_spring": ("size",), "external_solver": ("size",), "torque": ("where",),
    "curve": ("uncertainty",), "consensus": ("spread",), "consensus_curve": ("uncertainty", "codes"),
    "fung_orthotropic": ("sheets",), "holzapfel_gasser_ogden": ("sheets",), "holzapfel_ogden": ("sheets",),
}  # fmt: skip
_SAMPLES = {
    "integer": "20", "flag": "yes", "text": '"text"', "file": '"file.vtu"', "files": '"file.csv"',
    "texts": '"force"', "amount": "1 mm", "amounts": "53.4 mm", "direction": "-z", "condition": "x <= 0 mm",
    "components": "(x, y)", "names": "[NAME_OF_MODEL, NAME_OF_MODEL]", "list": "[10, 5, 2.5] mm",
    "points": "[(5, 0), (20, 0), (20, 10)] mm", "target": "NAME_OF_PARAMETER", "targets": "[NAME_OF_PARAMETER]",
    "variants": "[10, 5, 2.5] mm", "vectors": "[(0, 0, 0), (0, 0, 1), (1, 0, 1)] m", "pairs": "[(1, 2), (2, 3)]",
    "each": "20 mm", "fibres": "+x",
}  # fmt: skip
_OWN = {("column", "values"): "[10, 5] mm"}  # by word and field: as many as there are models
_LISTS = {units.NONE: "[0.3, 0.2]", units.LENGTH: _SAMPLES["list"]}  # lists by dimension


def example(c: Constructor) -> str:
    """Return an example call with all required fields and the most commonly needed optional ones."""
    chosen = (*_CHOSEN.get(c.name, ()), *(names[0] for names in getattr(c.cls, "either", ())))
    given = [f for f in c.fields if f.required or f.name in chosen]
    files = {f.name: _FILES[c.name] for f in given if f.form == "file" and c.name in _FILES}
    own = {f.name: files.get(f.name) or _OWN.get((c.name, f.name)) or sample(f) for f in given}
    arguments = [f"{name} = {value}" for name, value in own.items()]
    return f"{c.name}({', '.join(arguments)})"


def sample(f: Field) -> str:
    """Return a valid value for a field, as written in a scene."""
    if f.name in _FITTING:
        return _FITTING[f.name]
    if f.name == "over" and f.kind == "metric":
        return "NAME_OF_ANOTHER_METRIC"
    if f.name == "rigid" and f.kind == "body":
        return "NAME_OF_RIGID_BODY"
    if f.name == "to" and f.form == "vector":  # a point different from that of `from`
        return f"(1, 1, 2) {units.vector_unit(f.dimension or units.NONE)}"
    if f.form == "quantity":
        dimension = f.dimension or units.NONE
        return _QUANTITIES.get(dimension, f"1 {units.si_unit(dimension)}")
    if f.form == "each" and f.dimension == units.PRESSURE:
        return "[60, 2] kPa"
    if f.form == "list" and f.dimension is not None:
        return _LISTS.get(f.dimension, f"[1, 10] {units.si_unit(f.dimension)}")
    if f.form == "vector":
        return f"(1, 1, 1) {units.vector_unit(f.dimension or units.NONE)}"
    if f.form == "choice":
        return f.options[0]
    if f.form == "value":
        return _VALUES.get(f.kind, f"NAME_OF_{f.kind.upper()}")
    return _SAMPLES.get(f.form, f"NAME_OF_{f.kind.upper()}")

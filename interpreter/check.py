"""What can be said of a compiled scene without building anything: physics that cannot be, or is doubtful.

To add a check: a function that yields diagnostics, a line in CHECKS.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter import schema, units
from softmark.interpreter.cantilever import cantilever_of
from softmark.interpreter.case import Case, Fault, body_of, case_of, fault
from softmark.interpreter.plan import plan_of
from softmark.interpreter.scene import Declared, Scene
from softmark.interpreter.vocabulary.loads import Gravity, PointForce
from softmark.solvers.mesh.shapes import contains

LIGHTEST, HEAVIEST = 10.0, 30_000.0  # kg/m^3: an aerogel and more than osmium
STRONGEST_PULL = 100.0  # m/s^2


def check(scene: Scene) -> list[Diagnostic]:
    """All errors and warnings about a scene that compiled without error."""
    found: list[Diagnostic] = []
    for test in CHECKS:
        try:
            found.extend(test(scene))
        except Fault as error:
            found.append(error.diagnostic)
    return list(dict.fromkeys(found))  # a body of several models is complained about once


def _cases(scene: Scene, kind: str) -> Iterator[tuple[Declared, Case]]:
    for declared in scene.of_kind(kind).values():
        yield declared, case_of(scene, body_of(scene, declared))


def _one_analysis(scene: Scene) -> Iterator[Diagnostic]:
    for extra in list(scene.of_kind("analysis").values())[1:]:
        at = extra.location
        yield Diagnostic("E222", "a scene has one analysis, this is another", at.source, at.span, "the second analysis",
                         "keep one, and write another scene for the other")  # fmt: skip


def _selections(scene: Scene) -> Iterator[Diagnostic]:
    """Conditions that select nothing or everything, as far as the body's bounds tell."""
    for kind in ("support", "load"):
        for declared in scene.of_kind(kind).values():
            condition = getattr(declared.thing, "where", None)
            body = scene.declared.get(getattr(declared.thing, "body", ""))
            if condition is None or body is None or not hasattr(body.thing.shape, "bounds"):
                continue
            low, high = body.thing.shape.bounds
            false, true = condition.over(low, high)
            at = declared.at("where")
            if not true:
                spans = ", ".join(f"{n} from {units.show(a, units.LENGTH)} to {units.show(b, units.LENGTH)}"
                                  for n, a, b in zip("xyz", low, high, strict=True))  # fmt: skip
                yield Diagnostic("E302", f"`{declared.name}` selects no part of `{body.name}`", at.source, at.span,
                                 "selects nothing", f"the body spans {spans}")  # fmt: skip
            elif not false:
                yield Diagnostic("E303", f"`{declared.name}` selects all of `{body.name}`", at.source, at.span,
                                 "selects everything", "select a part of the body")  # fmt: skip


def _held(scene: Scene) -> Iterator[Diagnostic]:
    for model, case in _cases(scene, "model"):
        if not case.supports:
            at = case.body.location
            yield Diagnostic("E306", f"nothing holds `{case.body.name}`: it is free to move and turn", at.source, at.span,
                             f"`{model.name}` looks for its equilibrium",
                             f"hold a part of it: `support wall = fixed({case.body.name}, where = x <= 0 mm)`")  # fmt: skip


def _densities(scene: Scene) -> Iterator[Diagnostic]:
    for declared in scene.of_kind("material").values():
        density = declared.thing.density
        if LIGHTEST <= density <= HEAVIEST:
            continue
        at = declared.at("density")
        factor = 1000.0 if density < LIGHTEST else 1e-3
        yield Diagnostic("W303", f"a density of {units.show(density, (-3, 1, 0, 0, 0))} is not that of any solid", at.source, at.span,
                         "a thousand times off?", f"water has 1000 kg/m^3, or 1 g/cm^3; did you mean {density * factor:g} kg/m^3?")  # fmt: skip


def _gravities(scene: Scene) -> Iterator[Diagnostic]:
    for declared in scene.of_kind("load").values():
        if isinstance(declared.thing, Gravity) and declared.thing.magnitude > STRONGEST_PULL:
            at = declared.at("magnitude")
            yield Diagnostic("W307", f"gravity of {declared.thing.magnitude:g} m/s^2 is {declared.thing.magnitude / 9.81:.0f} times that of Earth",
                             at.source, at.span, "very strong", "on Earth it is 9.81 m/s^2")  # fmt: skip


def _models(scene: Scene) -> Iterator[Diagnostic]:
    for model, case in _cases(scene, "model"):
        yield from model.thing.doubts(model, case)


def _references(scene: Scene) -> Iterator[Diagnostic]:
    for reference, case in _cases(scene, "reference"):
        try:
            cantilever_of(reference, case)
        except Fault as refused:
            yield refused.diagnostic


def _places(scene: Scene) -> Iterator[Diagnostic]:
    """Probes and point forces outside their body."""
    for declared in scene.declared.values():
        points = getattr(declared.thing, "stations", None)
        points = (declared.thing.at,) if isinstance(declared.thing, PointForce) else points
        if points is None or "." in declared.name:
            continue
        body = scene.declared[declared.thing.body]
        if not hasattr(body.thing.shape, "section"):
            continue
        outside = next((p for p in (points[0], points[-1]) if not contains(body.thing.shape, p)), None)
        if outside is not None:
            field = "at" if "at" in declared.fields else "from" if outside == points[0] else "to"
            where = ", ".join(units.show(c, units.LENGTH) for c in outside)
            yield fault("E504", declared.at(field), f"`{declared.name}` looks at ({where}), outside `{body.name}`",
                        "not in the body", "give coordinates of the undeformed body").diagnostic  # fmt: skip


def _metrics(scene: Scene) -> Iterator[Diagnostic]:
    """A metric compares its probe with a reference of the same body."""
    for metric in scene.of_kind("metric").values():
        against = getattr(metric.thing, "against", None)
        if against is None:
            continue
        looked = scene.declared[metric.thing.probe].thing.body
        known = body_of(scene, scene.declared[against])
        if looked != known:
            yield fault("E505", metric.location, f"`{metric.name}` compares points of `{looked}` with a solution for `{known}`",
                        "different bodies", "use a probe and a reference of the same body").diagnostic  # fmt: skip


def _idle(scene: Scene) -> Iterator[Diagnostic]:
    """Models that nothing asks about."""
    plan = plan_of(scene)
    for name, model in scene.of_kind("model").items():
        if name not in plan.models:
            at = model.location
            yield Diagnostic("W308", f"nothing asks for `{name}`, so it will not be computed", at.source, at.span, "not asked for",
                             "add a probe, a metric or an expectation of its body")  # fmt: skip


def _unused(scene: Scene) -> Iterator[Diagnostic]:
    for name, at in scene.unused.items():
        declared = scene.declared.get(name)
        kind = declared.kind if declared else "parameter"
        if kind in ("parameter", "material", "shape", "body"):
            yield Diagnostic("W309", f"the {kind} `{name}` is not used", at.source, at.span, "never used",
                             f"remove it, or use it; it is {schema.article(kind)} {kind} of this scene only")  # fmt: skip


CHECKS: tuple[Callable[[Scene], Iterator[Diagnostic]], ...] = (
    _one_analysis, _selections, _held, _densities, _gravities, _models, _references, _places, _metrics, _idle, _unused,
)  # fmt: skip

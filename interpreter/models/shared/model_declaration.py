"""What every model says of itself: the words of a model derive from `Model`, and say what is otherwise.

Nobody asks which model one is. What a scene may put on it, how finely it solves, what it is a member of and how it is
made plain are asked of the words; what needs arrays, of what its builder prepares (`shared/prepared_model.py`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Self

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.problem.conforming_mesh import cuts_of
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.interpreter.vocabulary.load_words import (
    AtPoint,
    Follower,
    PerArea,
    PerLength,
    PerMass,
    Routed,
    Tensile,
    Turning,
)
from softmark.interpreter.vocabulary.support_words import Hinged, Holding, Level

if TYPE_CHECKING:
    from softmark.interpreter.language.compiled_scene import Declared, Scene
    from softmark.interpreter.problem.body_case import Case
    from softmark.interpreter.problem.conforming_mesh import Cuts
    from softmark.interpreter.results.run_report import ModelKind
    from softmark.solvers.mesh.shape import Shape

MOST = "`fem(...)` takes all"
OF_NETWORKS = "networks take gravity, forces and lines of force on axes, and torques; `fixed`, `displaced` and `hinged`"
UNKNOWN = "not a load that it takes"
_SOME: dict[type, tuple[str, str]] = {  # loads of some models alone: why, and what to do
    PerLength: (UNKNOWN, "use a traction on a strip; `fem(...)` and beams take lines"),
    Routed: (
        "it pulls at points and presses along a line, which has no limit in a solid",
        "tendons are of beams: `beam6dof(...)`; of a solid, what its end pulls may be a traction on a face",
    ),
}


class Model:
    """A model as a scene declares it, where nothing else is said."""

    # what a scene may put on it: `refusals` says so of all else, when the scene is checked
    loads: tuple[type[Any], ...] = (PerMass, PerArea, Tensile, Follower, Turning, AtPoint)  # how they may act
    supports: tuple[type[Any], ...] = (Holding,)  # what they are
    bedded = False  # it takes bodies that lie on springs
    touches = False  # it takes bodies that touch others
    moves = True  # it takes dynamic analyses
    wired = False  # it is of networks of axes, and of nothing else
    sectional = False  # it moves by whole sections, about an axis, which may be hollow
    composite = False  # it takes bodies with parts of other materials
    graded = False  # it takes materials whose constants vary in space
    directed = False  # it takes materials that know directions
    remembers = False  # it takes materials whose stress relaxes
    soaks = False  # it takes materials that fluid seeps through
    recovers = False  # it finds back to rest from any state

    # what it is
    reduces: str | None = None  # the model whose equations it reduces
    constant = False  # its stiffness never changes
    read = False  # from a file, which says what it says, whatever the body is
    timed = True  # it is solved here, and by a clock
    unwalked = ""  # why `dsl stress` does not look for where it goes wrong, where it does not
    forceless: str | None = None  # why it says nothing of forces, where it does not
    even = False  # its strain is the same everywhere, at its ends too
    unsolved = False  # it may accept states that are not solved
    finely: tuple[str, ...] = ()  # its fields that say how finely it solves

    @property
    def own_mesh(self) -> Shape | None:
        """A mesh from a file in place of one that is made of the body's shape."""
        return None

    @property
    def other_material(self) -> Any:
        """The material that it takes in place of the body's, None of one that takes the body's."""
        return None

    @property
    def capped_at(self) -> int | None:
        """Newton iterations after which a state, or a time step, is accepted, solved or not."""
        return None

    @property
    def shortcuts(self) -> tuple[str, ...]:
        """Its fields by which steps are not solved, or not in double precision, or not from rest."""
        return ()

    @property
    def stress_law(self) -> tuple[str, str] | str:
        """The measure of strain and the way to keep the volume that stress follows from, or why there is none."""
        return "only finite elements and beams have a stress at every point of the body"

    def doubts(self, declared: Declared, case: Case) -> list[Diagnostic]:
        """What speaks against it in this case, errors and warnings that need no arrays."""
        return list(self.refusals(declared, case))

    def scene_doubts(self, scene: Scene, declared: Declared, case: Case) -> list[Diagnostic]:
        """The same that must know the whole scene."""
        return []

    def outline(self, case: Case) -> str:
        """What will be built, on one line."""
        raise NotImplementedError(f"{type(self).__name__} has no outline")

    def kind(self, case: Case) -> ModelKind | None:
        """What it is but for its size and Poisson's ratio; None of one that is alone of its kind."""
        return None

    def mesh_key(self) -> tuple[Any, ...] | None:
        """What two models of a body must agree in to share a mesh; None of one without a mesh."""
        return None

    def cuts(self, case: Case, shape: Shape | None = None) -> Cuts:
        """What its meshes must follow."""
        return cuts_of(case, shape)

    def mesh_words(self, case: Case) -> str:
        """Its mesh in words."""
        return ""

    def plain(self, **changes: Any) -> Self:
        """The same without what it trades for speed, and with other fields."""
        changed: Any = replace(self, **changes)  # type: ignore[type-var]
        made: Self = changed
        return made

    def orders(self) -> dict[str, int]:
        """The order in displacements that theory gives its fields in `finely`, where the solution is smooth."""
        return {}

    def refusals(self, declared: Declared, case: Case) -> Iterator[Diagnostic]:
        """Errors for the analysis, the loads and the supports that it does not take."""
        if not self.moves and isinstance(case.analysis, Dynamic):
            yield diagnostic("E501", declared.at(),
                             f"`{declared.name}` knows no motion, only the state of rest", "a static model",
                             "use `fem(...)` or `beam6dof(...)` in a dynamic analysis")  # fmt: skip
        for load in case.loads:
            if not isinstance(load.thing.action, self.loads):
                label, help = _SOME.get(type(load.thing.action), (UNKNOWN, self._most))
                label = UNKNOWN if case.shape.wired else label  # which is no solid
                yield diagnostic("E501", load.at(), f"`{declared.name}` cannot represent the load `{load.name}`",
                                 label, help)  # fmt: skip
        for support in case.supports:
            if not isinstance(support.thing, self.supports):
                hinge = "a hinge holds points of a `network(...)`, and `frame6dof(...)` takes it"
                yield diagnostic("E501", support.at(),
                                 f"`{declared.name}` cannot represent the support `{support.name}`",
                                 "not a support that it takes",
                                 hinge if isinstance(support.thing, Hinged) else self._most)  # fmt: skip
        for bed in () if self.bedded else case.beds:
            yield diagnostic("E501", bed.at(), f"`{declared.name}` cannot represent the support `{bed.name}`",
                             "springs on a surface", "`fem(...)` takes them")  # fmt: skip
        for plate in case.beds if isinstance(case.analysis, Dynamic) else ():
            if isinstance(plate.thing, Level):
                yield diagnostic("E413", plate.at(), f"`{plate.name}` has no mass to move with, and the analysis is"
                                 " dynamic", "not in motion", "use it at rest or with `quasistatic(...)`, or move the"
                                 " face by `displaced(...)`")  # fmt: skip
        if case.contacts:
            from softmark.interpreter.models.shared import contact_capabilities

            yield from contact_capabilities.refusals(self, declared, case)
        if case.pairs:
            from softmark.interpreter.models.shared import self_contact_capabilities

            yield from self_contact_capabilities.refusals(self.bedded, declared, case)
        yield from self.turns(declared, case)
        yield from self.forgets(declared, case)

    @property
    def _most(self) -> str:
        """What takes it, of what it does not take itself."""
        return OF_NETWORKS if self.wired else MOST

    def forgets(self, declared: Declared, case: Case) -> Iterator[Diagnostic]:
        """Errors for fluid and stress that relaxes, where it cannot follow them; a warning where steps hide them."""
        if case.porous or case.drains:
            from softmark.interpreter.models.shared import fluid_capabilities

            yield from (
                fluid_capabilities.refusals(self, declared, case) if case.porous else fluid_capabilities.idle(case)
            )
        elif case.remembers:
            from softmark.interpreter.models.shared import relaxation_capabilities

            yield from relaxation_capabilities.refusals(self, declared, case)

    def turns(self, declared: Declared, case: Case) -> Iterator[Diagnostic]:
        """Errors for supports that turn, where it cannot follow them."""
        if any(support.thing.turns for support in case.supports):
            from softmark.interpreter.models.shared import rotating_supports

            yield from rotating_supports.refusals(self, declared, case)

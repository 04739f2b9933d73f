"""Blocks of one section end to end, pressed together: the patch test of contact."""

from __future__ import annotations

import math
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.beam_centre_line import points_of
from softmark.references.reference_base import About, Reference
from softmark.references.straight_cantilever import Refused, Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np

STEPS = 100  # largest number of Newton steps; about 5 are needed
JUST = 1e-12  # relative to the length: blocks compressed by less only touch, since coordinates are rounded
CLOSE = 1e-12  # relative: a step after which the next is rounding
TOO_FAR = "it is pressed by more than its law holds", "press it by less"


@dataclass(frozen=True)
class Solid:
    """What a block is made of, pulled along one axis by a stress P per area at rest; its sides carry none.

    Hooke's solid of small strain, or if `large` the neo-Hookean one with ln J at any. With a stretch l along the axis
    and t in each of the n directions that are `free`, mu (t^2 - 1) + lam ln(l t^n) = 0 and P = mu (l - t^2 / l).
    """

    young: float  # Pa
    poisson: float
    large: bool
    free: int  # directions across in which it narrows: 2, and 1 in plane strain

    @property
    def modulus(self) -> float:
        """Of a small strain along the axis, Pa."""
        return self.young if self.free == 2 else self.young / (1.0 - self.poisson**2)

    @property
    def mu(self) -> float:
        """Shear modulus, Pa."""
        return 0.5 * self.young / (1.0 + self.poisson)

    @cached_property
    def _ratio(self) -> float:
        """lam / mu: 2 nu / (1 - 2 nu)."""
        return math.inf if self.poisson == 0.5 else 2.0 * self.poisson / (1.0 - 2.0 * self.poisson)

    def narrow(self, e: float) -> tuple[float, float]:
        """ln t of e = ln l, and its derivative; by Newton's method, of a convex function."""
        n, lam = self.free, self._ratio
        if math.isinf(lam):
            return -e / n, -1.0 / n
        s = -lam * e / (2.0 + n * lam)
        for _ in range(STEPS):
            step = (math.expm1(2.0 * s) + lam * (e + n * s)) / (2.0 * math.exp(2.0 * s) + n * lam)
            s -= step
            if abs(step) <= CLOSE * abs(s):
                break
        return s, -lam / (2.0 * math.exp(2.0 * s) + n * lam)

    def pull(self, e: float) -> tuple[float, float]:
        """P, Pa, of e = ln l, and its derivative."""
        s, slope = self.narrow(e)
        l, t2 = math.exp(e), math.exp(2.0 * s)
        P = self.mu * (math.expm1(2.0 * e) - math.expm1(2.0 * s)) / l
        return P, self.mu * (l + t2 / l * (1.0 - 2.0 * slope))

    def strains(self, P: float) -> tuple[float, float, float]:
        """l - 1 and t - 1 at a stress, Pa, and the derivative of l, 1/Pa. Raises Refused."""
        if not self.large:
            nu = self.poisson if self.free == 2 else self.poisson / (1.0 - self.poisson)
            return P / self.modulus, -nu * P / self.modulus, 1.0 / self.modulus

        def off(e: float) -> tuple[float, float]:
            own, slope = self.pull(e)
            return own - P, slope

        e = root(off, math.asinh(P / self.modulus))
        return math.expm1(e), math.expm1(self.narrow(e)[0]), math.exp(e) / self.pull(e)[1]

    def under(self, traction: float, pressure: float) -> float:
        """P, Pa, where a dead traction acts on its end, and a pressure on what that has become. Raises Refused."""
        if not self.large or not pressure:
            return traction - pressure

        def off(e: float) -> tuple[float, float]:
            P, slope = self.pull(e)
            s, narrower = self.narrow(e)
            area = math.exp(self.free * s)
            return P - traction + pressure * area, slope + pressure * area * self.free * narrower

        return self.pull(root(off, math.asinh((traction - pressure) / self.modulus)))[0]

    def stresses(self, P: float) -> tuple[float, float]:
        """Along the axis and across where it is held, per area as it is deformed, Pa (per area at rest of Hooke's)."""
        if not self.large:
            return P, self.poisson * P
        l, t, _ = self.strains(P)
        J = (1.0 + l) * (1.0 + t) ** self.free
        return P * (1.0 + l) / J, -self.mu * t * (2.0 + t) / J


def root(f: Any, x: float) -> float:
    """Of a function with its derivative, by Newton's method from x. Raises Refused where it finds none."""
    for _ in range(STEPS):
        try:
            value, slope = f(x)
        except ArithmeticError:
            break
        if not slope > 0.0:
            break
        x, step = x - value / slope, value / slope
        if abs(step) <= CLOSE * abs(x):
            return x
    raise Refused(*TOO_FAR)


@dataclass(frozen=True)
class Block:
    """One of a stack: from `low` to `high` along the axis, m."""

    low: float
    high: float
    solid: Solid
    root: Vector  # m: fixed lateral position

    @property
    def length(self) -> float:
        """m."""
        return self.high - self.low


@dataclass(frozen=True)
class Joint:
    """Between a block and the next: a `gap` that may close, m, or one that is `glued`, and stays as it is."""

    gap: float = 0.0
    glued: bool = False


@dataclass(frozen=True)
class Stack:
    """Blocks of one section in their order along x, y or z (`way`), and what holds and presses their ends. SI units."""

    blocks: tuple[Block, ...]
    joints: tuple[Joint, ...]
    way: int
    across: tuple[int, ...]  # directions in which they narrow
    low: Vector  # m, of its bounds
    high: Vector
    area: float  # m^2, of a section; all around of a body of revolution
    turns: bool  # a body of revolution about y
    ends: tuple[float | None, float | None]  # m, axial displacement of an end; None for a loaded end
    traction: float = 0.0  # Pa, outward on the loaded end, per area at rest
    pressure: float = 0.0  # Pa, inward on it, per area as it is

    @property
    def gaps(self) -> float:
        """All together, m."""
        return sum(joint.gap for joint in self.joints if not joint.glued)

    @property
    def grown(self) -> float:
        """By how much its length changes where no gap is left, m, of one whose ends are both moved."""
        low, high = self.ends
        assert low is not None
        assert high is not None
        return high - low + self.gaps

    @property
    def touching(self) -> bool:
        """Whether some of its blocks are not glued."""
        return any(not joint.glued for joint in self.joints)

    def stress(self) -> float:
        """Along the axis, per area at rest, the same everywhere, Pa. Raises Refused."""
        if None in self.ends:
            return self.blocks[0 if self.ends[0] is None else -1].solid.under(self.traction, self.pressure)
        if self.touching and self.grown >= -JUST * (self.blocks[-1].high - self.blocks[0].low):
            return 0.0
        soft = sum(block.length / block.solid.modulus for block in self.blocks)

        def off(P: float) -> tuple[float, float]:
            each = [(block.length, *block.solid.strains(P)) for block in self.blocks]
            return sum(L * along for L, along, _, _ in each) - self.grown, sum(L * slope for L, _, _, slope in each)

        return root(off, self.grown / soft)


@dataclass(frozen=True)
class PressedStack:
    """What becomes of it at a stress, Pa."""

    stack: Stack
    stress: float

    @property
    def left(self) -> float:
        """What is left of its gap, m: of one alone, all others are closed."""
        return max(self.stack.grown, 0.0) if self.stack.touching and None not in self.stack.ends else 0.0

    @property
    def pull(self) -> float:
        """Through every section, N."""
        return self.stress * self.stack.area

    @property
    def push(self) -> float:
        """What presses, N."""
        return max(-self.pull, 0.0)

    @cached_property
    def strains(self) -> tuple[tuple[float, float], ...]:
        """Of each block, along and across: what its lengths become, less 1."""
        return tuple(block.solid.strains(self.stress)[:2] for block in self.stack.blocks)

    @cached_property
    def shifts(self) -> tuple[float, ...]:
        """By how much the low end of each block moves along the axis, m."""
        stack = self.stack
        grown = [block.length * along for block, (along, _) in zip(stack.blocks, self.strains, strict=True)]
        # between compressed blocks gaps are closed; a remaining gap follows from the ends
        opened = [0.0 if joint.glued else self.left - joint.gap for joint in stack.joints]
        found = [0.0]
        for more, joint in zip(grown, opened, strict=False):
            found.append(found[-1] + more + joint)
        low, high = stack.ends
        if low is None:
            assert high is not None
            low = high - found[-1] - grown[-1]
        return tuple(low + shift for shift in found)

    def section(self, number: int) -> list[tuple[float, float]]:
        """Lowest and highest coordinate of a block as it is deformed, m, in the directions across."""
        stack, block, t = self.stack, self.stack.blocks[number], 1.0 + self.strains[number][1]
        return [
            (block.root[c] + t * (stack.low[c] - block.root[c]), block.root[c] + t * (stack.high[c] - block.root[c]))
            for c in stack.across
        ]

    def _common(self, number: int) -> tuple[float, float]:
        """The area of the joint above a block that both sides have, as they are deformed, m^2, and what share of the
        larger side that is."""
        one, other = self.section(number), self.section(number + 1)
        both = [(max(a, c), min(b, d)) for (a, b), (c, d) in zip(one, other, strict=True)]
        rest = [(self.stack.low[c], self.stack.high[c]) for c in self.stack.across]
        if self.stack.turns:
            areas = [(b - a) * (b + a) for ((a, b),) in (one, other, both, rest)]
        else:
            areas = [math.prod(b - a for a, b in sides) for sides in (one, other, both, rest)]
        return self.stack.area * areas[2] / areas[3], areas[2] / max(areas[:2])

    def touched(self, number: int) -> float:
        """The area of contact of the joint above a block, m^2: at rest of Hooke's solids, 0 where a gap is left."""
        if not self.push:
            return 0.0
        large = all(block.solid.large for block in self.stack.blocks[number : number + 2])
        return self._common(number)[0] if large else self.stack.area

    @property
    def area(self) -> float:
        """Of its contacts, m^2: the least."""
        open_joints = [i for i, joint in enumerate(self.stack.joints) if not joint.glued]
        return min((self.touched(i) for i in open_joints), default=0.0)

    @property
    def off(self) -> dict[str, float]:
        """By how much, relative, its force may be off: strain of Hooke's solids, and edges that stand over."""
        known = zip(self.stack.blocks, self.strains, strict=True)
        small = max((abs(along) for block, (along, _) in known if not block.solid.large), default=0.0)
        over = max((1.0 - self._common(i)[1] for i, joint in enumerate(self.stack.joints) if not joint.glued),
                   default=0.0)  # fmt: skip
        return {"strain": small} | ({"overhang": over} if over > 1e-12 else {})

    def blocks_at(self, X: Array) -> Any:
        """The number of the block at each of the points X (n, 3), the nearest of those between two (n,)."""
        middles = [0.5 * (a.high + b.low) for a, b in pairwise(self.stack.blocks)]
        return np.searchsorted(np.array(middles), X[:, self.stack.way])

    def displacement(self, X: Array) -> Array:
        """Of points X (n, 3) of the undeformed body (n, 3), m. Raises Refused."""
        X, stack = points_of(X), self.stack
        which, found = self.blocks_at(X), np.zeros((len(X), 3))
        roots = np.array([block.root for block in stack.blocks])[which]
        along, across = np.array(self.strains).T[:, which]
        for c in stack.across:
            found[:, c] = across * (X[:, c] - roots[:, c])
        low = np.array([block.low for block in stack.blocks])[which]
        found[:, stack.way] = np.array(self.shifts)[which] + along * (X[:, stack.way] - low)
        return found

    def fields(self, X: Array) -> tuple[Array, Array]:
        """The gradient of the displacement at points X (n, 3), and the Cauchy stress, Pa, each (n, 3, 3)."""
        stack, which = self.stack, self.blocks_at(X)
        H, sigma = np.zeros((len(stack.blocks), 3, 3)), np.zeros((len(stack.blocks), 3, 3))
        for i, (block, (along, across)) in enumerate(zip(stack.blocks, self.strains, strict=True)):
            axial, held = block.solid.stresses(self.stress)
            for c in range(3):
                narrow = c in stack.across or stack.turns
                H[i, c, c] = along if c == stack.way else across if narrow else 0.0
                sigma[i, c, c] = axial if c == stack.way else 0.0 if narrow else held
        return H[which], sigma[which]

    @property
    def estimated_error(self) -> float:
        """m: rounding."""
        return 1e-13 * max(map(abs, (*self.shifts, *(b.length * e for b, (e, _) in zip(
            self.stack.blocks, self.strains, strict=True)))))  # fmt: skip


@dataclass(frozen=True)
class PatchTest(Reference):
    """Blocks end to end that are pressed together or glued, with no friction: stress is the same everywhere.

    The patch test of contact: whatever the meshes, a uniform pressure goes through joints as it is. Ends that come
    nearer by d close the gaps g between blocks of lengths L, and P = -(d - g) / sum(L / E), E / (1 - nu^2) in the place
    of E in plane strain. Strain is small, but that of neo-Hookean blocks, which is of any size: with the stretch t
    across of mu (t^2 - 1) + lam ln(l t^2) = 0, P = mu (l - t^2 / l) of the stretch l. Blocks that touch may each have
    their own material, by `region`, since their faces slide. Where the gap is not closed nothing presses.

    It takes `apart(...)` of boxes along x, y or z, or of upright rectangles in `plane_strain` or `axisymmetric`, with
    one section; joints that are met by `itself` across a gap, or `tied`; one end held along its normal, the other moved
    along it, or with a `traction`, `tension` or `pressure` on all of it; sides free or on planes of symmetry. Where
    nothing narrows (`poisson = 0`) ends may be `fixed`. Glued blocks, and those with friction, must narrow alike.
    Metrics of displacement, force and stress may be held against it. Of two things that models do it knows nothing: a
    barrier leaves a gap of less than its distance, by which they press harder, and glue opens by stress over stiffness.
    Source: Taylor and Papadopoulos 1991, On a patch test for contact problems in two dimensions.
    """

    body: Annotated[Any, "body", "the blocks"]

    about: ClassVar[About] = "stacked"
    with_forces: ClassVar[bool] = True
    with_stress: ClassVar[bool] = True
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Taylor and Papadopoulos 1991, in Nonlinear Computational Mechanics"
    error_meaning: ClassVar[str] = "rounding of the displacement, m: the formula solves its equations exactly"

    def solve(self, stack: Stack) -> PressedStack:
        """What it says. Raises Refused where a law does not hold so far."""
        return PressedStack(stack, stack.stress())

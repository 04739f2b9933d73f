"""Patch test of contact: blocks of one cross-section in line, pressed together."""

from __future__ import annotations

import math
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from softmark.records import dataclass
from softmark.references.beam_centre_line import as_points
from softmark.references.reference_base import Reference
from softmark.references.straight_cantilever import NotApplicable, Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
else:
    from softmark.references.lazy_imports import np

STEPS = 100  # largest number of Newton steps; about 5 are needed
JUST = 1e-12  # relative to the length: blocks compressed by less only touch, since coordinates are rounded
CLOSE = 1e-12  # relative: a step after which the next is rounding
TOO_FAR = "the compression exceeds what the law can carry", "reduce the compression"


@dataclass(frozen=True)
class BlockMaterial:
    """Material of a block under a uniaxial nominal stress P; the lateral sides are free of stress.

    The law is Hooke's for small strain or, if `large`, the neo-Hookean one with ln J. Let l be the stretch along the
    axis, and t the stretch in each of the n lateral directions that are `free`. The law then gives mu (t^2 - 1) + lam
    ln(l t^n) = 0 and P = mu (l - t^2 / l).
    """

    young: float  # Pa
    poisson: float
    large: bool
    free: int  # directions across in which it narrows: 2, and 1 in plane strain

    @property
    def modulus(self) -> float:
        """Axial modulus at small strain, Pa."""
        return self.young if self.free == 2 else self.young / (1.0 - self.poisson**2)

    @property
    def mu(self) -> float:
        """Shear modulus, Pa."""
        return 0.5 * self.young / (1.0 + self.poisson)

    @cached_property
    def _ratio(self) -> float:
        """Ratio of Lame's moduli lam / mu = 2 nu / (1 - 2 nu)."""
        return math.inf if self.poisson == 0.5 else 2.0 * self.poisson / (1.0 - 2.0 * self.poisson)

    def lateral_log_stretch(self, e: float) -> tuple[float, float]:
        """Return the logarithm of the lateral stretch for a logarithm e of the axial stretch, and its derivative by e.

        It is the root of a convex function, computed by Newton's method.
        """
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
        """Return the nominal stress P, Pa, for a logarithm e of the axial stretch, and its derivative by e."""
        s, slope = self.lateral_log_stretch(e)
        l, t2 = math.exp(e), math.exp(2.0 * s)
        P = self.mu * (math.expm1(2.0 * e) - math.expm1(2.0 * s)) / l
        return P, self.mu * (l + t2 / l * (1.0 - 2.0 * slope))

    def strains(self, P: float) -> tuple[float, float, float]:
        """Return axial and lateral strain at a nominal stress P, Pa, and the derivative of the axial strain by P, 1/Pa.

        Raises NotApplicable if no strain gives this stress.
        """
        if not self.large:
            nu = self.poisson if self.free == 2 else self.poisson / (1.0 - self.poisson)
            return P / self.modulus, -nu * P / self.modulus, 1.0 / self.modulus

        def off(e: float) -> tuple[float, float]:
            own, slope = self.pull(e)
            return own - P, slope

        e = find_root(off, math.asinh(P / self.modulus))
        return math.expm1(e), math.expm1(self.lateral_log_stretch(e)[0]), math.exp(e) / self.pull(e)[1]

    def stress_under_loads(self, traction: float, pressure: float) -> float:
        """Return the nominal stress P, Pa, under a dead traction on the end and a pressure on the deformed end.

        Raises NotApplicable.
        """
        if not self.large or not pressure:
            return traction - pressure

        def off(e: float) -> tuple[float, float]:
            P, slope = self.pull(e)
            s, narrower = self.lateral_log_stretch(e)
            area = math.exp(self.free * s)
            return P - traction + pressure * area, slope + pressure * area * self.free * narrower

        return self.pull(find_root(off, math.asinh((traction - pressure) / self.modulus)))[0]

    def stresses(self, P: float) -> tuple[float, float]:
        """Return the Cauchy stresses along the axis and in constrained lateral directions, Pa.

        For Hooke's law they are nominal.
        """
        if not self.large:
            return P, self.poisson * P
        l, t, _ = self.strains(P)
        J = (1.0 + l) * (1.0 + t) ** self.free
        return P * (1.0 + l) / J, -self.mu * t * (2.0 + t) / J


def find_root(f: Any, x: float) -> float:
    """Return a root of a function f, which returns its value and derivative, by Newton's method from x.

    Raises NotApplicable if no root is found.
    """
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
    raise NotApplicable(*TOO_FAR)


@dataclass(frozen=True)
class Block:
    """One block of a stack, from the coordinate `low` to `high` along the axis, m."""

    low: float
    high: float
    solid: BlockMaterial
    root: Vector  # m: fixed lateral position

    @property
    def length(self) -> float:
        """Length of the block, m."""
        return self.high - self.low


@dataclass(frozen=True)
class Joint:
    """Joint between a block and the next one: a `gap`, m, that may close, or a glued joint that keeps its distance."""

    gap: float = 0.0
    glued: bool = False


@dataclass(frozen=True)
class Stack:
    """Blocks of one cross-section in their order along x, y or z (`way`), and their end conditions. SI units."""

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
        """Sum of all gaps, m."""
        return sum(joint.gap for joint in self.joints if not joint.glued)

    @property
    def length_change(self) -> float:
        """Change of the stack's length, m, if its ends are displaced as prescribed and all gaps are closed.

        It is negative if the blocks are compressed. Both ends must be moved.
        """
        low, high = self.ends
        assert low is not None
        assert high is not None
        return high - low + self.gaps

    @property
    def has_unglued_joints(self) -> bool:
        """True if the stack has joints that are not glued."""
        return any(not joint.glued for joint in self.joints)

    def stress(self) -> float:
        """Axial nominal stress, Pa, uniform in the stack. Raises NotApplicable."""
        if None in self.ends:
            return self.blocks[0 if self.ends[0] is None else -1].solid.stress_under_loads(self.traction, self.pressure)
        if self.has_unglued_joints and self.length_change >= -JUST * (self.blocks[-1].high - self.blocks[0].low):
            return 0.0
        soft = sum(block.length / block.solid.modulus for block in self.blocks)

        def off(P: float) -> tuple[float, float]:
            each = [(block.length, *block.solid.strains(P)) for block in self.blocks]
            return sum(L * along for L, along, _, _ in each) - self.length_change, sum(
                L * slope for L, _, _, slope in each
            )

        return find_root(off, self.length_change / soft)


@dataclass(frozen=True)
class DeformedStack:
    """Deformed stack of blocks under a uniform axial nominal stress, Pa."""

    stack: Stack
    stress: float

    @property
    def left(self) -> float:
        """Remaining gap, m, if all other gaps are closed; 0 if there is contact everywhere."""
        return (
            max(self.stack.length_change, 0.0) if self.stack.has_unglued_joints and None not in self.stack.ends else 0.0
        )

    @property
    def pull(self) -> float:
        """Tensile force through every section, N."""
        return self.stress * self.stack.area

    @property
    def push(self) -> float:
        """Compressive force, N."""
        return max(-self.pull, 0.0)

    @cached_property
    def strains(self) -> tuple[tuple[float, float], ...]:
        """Axial and lateral strain of each block, as relative changes of its lengths."""
        return tuple(block.solid.strains(self.stress)[:2] for block in self.stack.blocks)

    @cached_property
    def shifts(self) -> tuple[float, ...]:
        """Axial displacement of the low end of each block, m."""
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
        """Return the lowest and highest deformed coordinates of a block, m, in the two lateral directions."""
        stack, block, t = self.stack, self.stack.blocks[number], 1.0 + self.strains[number][1]
        return [
            (block.root[c] + t * (stack.low[c] - block.root[c]), block.root[c] + t * (stack.high[c] - block.root[c]))
            for c in stack.across
        ]

    def _overlap_area(self, number: int) -> tuple[float, float]:
        """Return the deformed area in which two blocks overlap, m^2, and that area over the larger block's face.

        `number` is the number of the block below the joint.
        """
        one, other = self.section(number), self.section(number + 1)
        both = [(max(a, c), min(b, d)) for (a, b), (c, d) in zip(one, other, strict=True)]
        rest = [(self.stack.low[c], self.stack.high[c]) for c in self.stack.across]
        if self.stack.turns:
            areas = [(b - a) * (b + a) for ((a, b),) in (one, other, both, rest)]
        else:
            areas = [math.prod(b - a for a, b in sides) for sides in (one, other, both, rest)]
        return self.stack.area * areas[2] / areas[3], areas[2] / max(areas[:2])

    def joint_contact_area(self, number: int) -> float:
        """Return the contact area of a block with the next one, m^2: undeformed for Hooke's law, 0 if a gap remains."""
        if not self.push:
            return 0.0
        large = all(block.solid.large for block in self.stack.blocks[number : number + 2])
        return self._overlap_area(number)[0] if large else self.stack.area

    @property
    def area(self) -> float:
        """Smallest contact area of all joints, m^2."""
        open_joints = [i for i, joint in enumerate(self.stack.joints) if not joint.glued]
        return min((self.joint_contact_area(i) for i in open_joints), default=0.0)

    @property
    def relative_errors(self) -> dict[str, float]:
        """Estimated errors of the force, relative to the force, by name of the effect that the theory neglects.

        `strain`: the largest strain of a block with Hooke's law, because terms of second order in the strain are
        neglected.
        `overhang`: the largest fraction of a face that the next block does not touch, because stress is taken as
        uniform.
        """
        known = zip(self.stack.blocks, self.strains, strict=True)
        small = max((abs(along) for block, (along, _) in known if not block.solid.large), default=0.0)
        over = max((1.0 - self._overlap_area(i)[1] for i, joint in enumerate(self.stack.joints) if not joint.glued),
                   default=0.0)  # fmt: skip
        return {"strain": small} | ({"overhang": over} if over > 1e-12 else {})

    def blocks_at(self, X: Array) -> Any:
        """Return the number (n,) of the block that contains each of the points X (n, 3), or is nearest to it."""
        middles = [0.5 * (a.high + b.low) for a, b in pairwise(self.stack.blocks)]
        return np.searchsorted(np.array(middles), X[:, self.stack.way])

    def displacement(self, X: Array) -> Array:
        """Return displacements (n, 3), m, of points X (n, 3) of the undeformed body. Raises NotApplicable."""
        X, stack = as_points(X), self.stack
        which, found = self.blocks_at(X), np.zeros((len(X), 3))
        roots = np.array([block.root for block in stack.blocks])[which]
        along, across = np.array(self.strains).T[:, which]
        for c in stack.across:
            found[:, c] = across * (X[:, c] - roots[:, c])
        low = np.array([block.low for block in stack.blocks])[which]
        found[:, stack.way] = np.array(self.shifts)[which] + along * (X[:, stack.way] - low)
        return found

    def fields(self, X: Array) -> tuple[Array, Array]:
        """Return the displacement gradient and the Cauchy stress, Pa, at points X (n, 3), m, each (n, 3, 3)."""
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
        """Rounding error of a displacement, m."""
        return 1e-13 * max(map(abs, (*self.shifts, *(b.length * e for b, (e, _) in zip(
            self.stack.blocks, self.strains, strict=True)))))  # fmt: skip


@dataclass(frozen=True)
class PatchTest(Reference):
    """Patch test of contact: blocks in line, pressed together or glued without friction, under uniform stress.

    A uniform pressure passes through joints unchanged, whatever the meshes. If the ends approach by d, they close the
    gaps g between blocks of lengths L, and P = -(d - g) / sum(L / E), with E / (1 - nu^2) instead of E in plane strain.
    Strain is small, except in neo-Hookean blocks, where it is of any size: with the lateral stretch t of mu (t^2 - 1) +
    lam ln(l t^2) = 0, P = mu (l - t^2 / l) for the stretch l. Blocks in contact may each have their own material, by
    `region`, since their faces slide. While the gap is open there is no pressure.

    It applies to `disjoint(...)` of boxes along x, y or z, or of upright rectangles in `plane_strain` or
    `axisymmetric`, with one section; joints that are `self_contact` across a gap, or `tied`; one end held along its
    normal, the other moved along it, or with a `traction`, `remote_stress` or `pressure` on all of it; sides free or on
    planes of symmetry. Without lateral contraction (`poisson = 0`) ends may be `fixed`. Glued blocks, and those with
    friction, must contract alike. It can be compared with metrics of displacement, force and stress. Two properties of
    models are not included: a barrier leaves a gap of less than its distance, so the blocks are compressed more, and a
    tied joint opens by stress over stiffness.
    Source: Taylor and Papadopoulos 1991, On a patch test for contact problems in two dimensions.
    """

    body: Annotated[Any, "body", "the blocks"]

    problem_kind: ClassVar[str] = "block_stack"
    means: ClassVar[str] = "closed form"
    source: ClassVar[str] = "Taylor and Papadopoulos 1991, in Nonlinear Computational Mechanics"
    error_meaning: ClassVar[str] = "rounding of the displacement, m: the formula solves its equations exactly"

    def solve(self, stack: Stack) -> DeformedStack:
        """Return the deformed stack. Raises NotApplicable if a material law has no solution at this strain."""
        return DeformedStack(stack, stack.stress())

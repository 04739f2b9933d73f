"""Gaps to rigid shapes: laws over all kinds, distances against samples of their surfaces, poses, surfaces of files."""

from __future__ import annotations

import math
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from softmark.solvers.contact.rigid_transform import MovedGap, RigidMotion
from softmark.solvers.contact.signed_distance import GAPS, gap_of
from softmark.solvers.contact.signed_distance.distance_function import Gap
from softmark.solvers.contact.signed_distance.triangle_surface import TriangleSurface
from softmark.solvers.mesh.files.mesh_validation import UnreadableMesh
from softmark.solvers.mesh.files.triangle_proximity import closest_points
from softmark.solvers.mesh.mesh import Floats
from softmark.solvers.mesh.revolved_bodies import Cone, Revolved
from softmark.solvers.mesh.rigid_shapes import HalfSpace, Punch, RoundedBox, RoundedCone, RoundedRevolution
from softmark.solvers.mesh.shape import Shape, Vector3
from softmark.solvers.mesh.shapes import SHAPES, Box, Cylinder, MeshFile
from softmark.solvers.mesh.spheres import Ellipsoid, Sphere, SphericalShell
from softmark.solvers.mesh.tubes import Tube

AXIS: Vector3 = (0.0, 0.6, 0.8)
NOTCHED = ((0.0, 0.0), (1.0, 0.0), (1.0, 0.5), (0.4, 0.5), (0.4, 1.0), (1.2, 1.5), (0.0, 1.5))
BRICK = Box((2.0, 1.0, 1.5), (-1.0, -0.5, -0.75))
KINDS: dict[str, Shape] = {
    "half_space": HalfSpace((0.1, 0.2, 0.3), AXIS),
    "sphere": Sphere(1.0, (0.1, 0.2, 0.3)),
    "spherical_shell": SphericalShell(1.0, 0.4, (0.1, 0.2, 0.3)),
    "box": BRICK,
    "rounded_box": RoundedBox((2.0, 1.0, 1.5), 0.2, (-1.0, -0.5, -0.75)),
    "cylinder": Cylinder(2.0, 0.7, AXIS, (0.1, -0.5, -0.6)),
    "tube": Tube(2.0, 0.7, 0.3, AXIS, (0.1, -0.5, -0.6)),
    "cone": Cone(2.0, 0.9, 0.0, AXIS, (0.1, -0.5, -0.6)),
    "truncated": Cone(2.0, 0.4, 0.9, AXIS, (0.1, -0.5, -0.6)),
    "revolved": Revolved(NOTCHED, AXIS, (0.0, -0.5, -0.6)),
    "punch": Punch(0.8, 0.2, 1.5, AXIS, (0.0, -0.5, -0.6)),
    "tip": RoundedCone(1.2, 0.2, 1.5, AXIS, (0.0, -0.5, -0.6)),
    "extruded": SHAPES["extruded"](((0, 0), (1, 0), (1, 0.5), (0.4, 0.5), (0.4, 1), (0, 1.5)), 0.8, "x", -0.3),  # type: ignore[call-arg]
}
SURFACES = {"surface of a ball": (KINDS["sphere"], 0.3), "surface with a notch": (KINDS["revolved"], 0.4)}
WITHOUT = {"disjoint", "ellipsoid", "arc", "quadrilateral", "quarter_ring", "truncated_ellipsoid_shell",
           "truncated_ellipsoid_section"}  # fmt: skip
ALL = [*KINDS, *SURFACES]
STEP = 1e-6  # of differences: of second order, so that 1e-12 / 1e-2 is left at what is 1e-2 from an edge


@lru_cache(maxsize=32)
def gap(kind: str) -> Gap:
    if kind in SURFACES:
        shape, size = SURFACES[kind]
        return TriangleSurface(*shape.surface(size))
    made = gap_of(KINDS[kind])
    assert made is not None
    return made


def places(seed: int, n: int = 3000) -> Floats:
    return np.random.default_rng(seed).uniform(-2.0, 2.0, (n, 3))


def smooth(own: Gap, X: Floats, within: float = 1e-3) -> Floats:
    """Those around which nothing changes its closest part: seen by normals that turn no faster than curvature says."""
    n, H = own.look(X)[1:]
    kept = np.linalg.norm(H, axis=(1, 2)) < 0.1 / within
    for e in within * np.concatenate([np.eye(3), -np.eye(3)]):
        turned = own.look(X + e)[1] - n - H @ e
        kept &= np.linalg.norm(turned, axis=1) < 5.0 * (np.linalg.norm(H, axis=(1, 2)) * within) ** 2 + 1e-9
    return X[kept]


@pytest.mark.parametrize("kind", ALL)
def test_gradient_and_hessian_are_those_of_the_gap(kind: str) -> None:
    """By central differences, away from where the closest part changes: these are few."""
    own, X = gap(kind), places(1)
    far = smooth(own, X)
    assert len(far) > 0.85 * len(X)
    g, n, H = own.look(far)
    np.testing.assert_allclose(g, own.gap(far), atol=1e-14)
    ends = [(own.look(far + STEP * e), own.look(far - STEP * e)) for e in np.eye(3)]
    slope = np.stack([(a[0] - b[0]) / (2.0 * STEP) for a, b in ends], axis=1)
    np.testing.assert_allclose(n, slope, atol=1e-8)  # rounding is 1e-16 / 1e-6, curvature at most 100
    bend = np.stack([(a[1] - b[1]) / (2.0 * STEP) for a, b in ends], axis=2)
    np.testing.assert_allclose(H, bend, atol=1e-5)


@pytest.mark.parametrize("kind", ALL)
def test_laws_of_a_distance(kind: str) -> None:
    """|grad g| = 1, H n = 0, H symmetric, |g(X) - g(Y)| <= |X - Y|, and the way along n leads onto the surface."""
    own, X, Y = gap(kind), places(2), places(3)
    g, n, H = own.look(X)
    np.testing.assert_allclose(np.linalg.norm(n, axis=1), 1.0, rtol=1e-14)
    scale = 1.0 + np.linalg.norm(H, axis=(1, 2))
    assert np.abs(np.einsum("nij,nj->ni", H, n)).max(axis=1) / scale == pytest.approx(0.0, abs=1e-12)
    assert np.abs(H - H.transpose(0, 2, 1)).max(axis=(1, 2)) / scale == pytest.approx(0.0, abs=1e-12)
    for other in (Y, X + 1e-3 * Y):
        assert np.all(np.abs(g - own.gap(other)) <= np.linalg.norm(X - other, axis=1) + 1e-14)
    np.testing.assert_allclose(own.gap(X - g[:, None] * n), 0.0, atol=1e-13)


@lru_cache(maxsize=32)
def skin(kind: str) -> tuple[Floats, Floats]:
    """Points and triangles of its surface, of formulas that gaps do not share: meshes, and hulls of many balls."""
    shape = KINDS[kind]
    if shape.meshed:
        return shape.surface(0.1)
    from scipy.spatial import ConvexHull

    core, radius = _core(shape)
    way = np.random.default_rng(4).normal(size=(400, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    ends = np.concatenate([way, np.eye(3), -np.eye(3)])
    hull = ConvexHull((core[:, None] + radius * ends).reshape(-1, 3))
    return hull.points, hull.simplices


def _core(shape: Shape) -> tuple[Floats, float]:
    """Centres of balls whose hull is a rounded shape, and their radius, m."""
    if isinstance(shape, RoundedBox):
        low = np.array(shape.origin) + shape.rounding
        sides = np.array(shape.size) - 2.0 * shape.rounding
        return low + sides * np.array(np.meshgrid(*[[0, 1]] * 3)).reshape(3, -1).T, shape.rounding
    assert isinstance(shape, RoundedRevolution)
    axis, turn = np.array(shape.axis), np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    first = np.array([1.0, 0.0, 0.0])
    around = np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * np.cross(axis, first)
    return np.concatenate([np.array(shape.origin) + z * axis + r * around for r, z in shape.core]), shape.rounding


@pytest.mark.parametrize("kind", [k for k in KINDS if k != "half_space"])
def test_it_is_the_distance_to_the_nearest_of_many_points(kind: str) -> None:
    """100 000 points lie 0.01 apart, and facets of 0.1 are inscribed by 0.1^2 / (8 x 0.7) = 2e-3."""
    from scipy.spatial import cKDTree

    X, (points, triangles) = places(5, 500), skin(kind)
    rng = np.random.default_rng(6)
    a, b, c = (points[triangles[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    t = rng.choice(len(area), 100_000, p=area / area.sum())
    u, v = rng.uniform(size=(2, len(t), 1))
    root = np.sqrt(u)
    tree = cKDTree((1.0 - root) * a[t] + root * (1.0 - v) * b[t] + root * v * c[t])
    np.testing.assert_allclose(np.abs(gap(kind).gap(X)), tree.query(X)[0], atol=0.02)


@pytest.mark.parametrize("kind", [k for k in KINDS if k != "half_space"])
def test_inside_is_negative_and_bounds_and_volume_are_its_own(kind: str) -> None:
    """Volume as the share of 50 000 points of the bounds, of 0.2 at least: 0.9 % is one deviation.

    Bounds touch where one of 10 000 points is near: at a tip, 0.02."""
    shape, own = KINDS[kind], gap(kind)
    assert shape.bounds is not None
    assert shape.volume is not None
    low, high = (np.array(end) for end in shape.bounds)
    X = np.random.default_rng(7).uniform(low, high, (50_000, 3))
    inside = own.gap(X) < 0.0
    whole = float(np.prod(high - low))
    assert inside.mean() * whole == pytest.approx(shape.volume, rel=0.025)
    assert own.centroid == pytest.approx(X[inside].mean(axis=0), abs=0.02)
    for axis in range(3):
        for end in (low, high):
            Y = X[:10_000].copy()
            Y[:, axis] = end[axis]
            assert -1e-12 <= own.gap(Y).min() < 0.02, "bounds touch it, and nothing is beyond"
    few = X[:500]
    assert [shape.contains(tuple(x)) for x in few] == inside[:500].tolist()


@pytest.mark.parametrize("kind", ["rounded_box", "punch", "tip"])
def test_the_volume_of_what_is_rounded_is_that_of_a_hull_of_balls(kind: str) -> None:
    """Balls of 400 points, in rings of 60, are inscribed: 1 % is missing at most."""
    from scipy.spatial import ConvexHull

    volume = KINDS[kind].volume
    assert volume is not None
    found = ConvexHull(skin(kind)[0]).volume
    assert 0.99 * volume < found < volume


def test_values_by_hand() -> None:
    """Distances that a pencil gives."""
    own = gap("rounded_box")
    corner = np.array([[1.0, 0.5, 0.75]])
    assert own.gap(corner)[0] == pytest.approx(0.2 * (math.sqrt(3.0) - 1.0))
    assert own.gap(np.zeros((1, 3)))[0] == pytest.approx(-0.5)
    tip = gap_of(RoundedCone(math.pi / 3.0, 0.1, 2.0, (0.0, 0.0, 1.0)))
    assert tip is not None
    g, n, H = tip.look(np.array([[0.0, 0.0, -0.3]]))
    assert g[0] == pytest.approx(0.3)
    np.testing.assert_allclose(n[0], [0.0, 0.0, -1.0])
    np.testing.assert_allclose(H[0], np.diag([2.5, 2.5, 0.0]), atol=1e-12)  # of a sphere 0.4 away
    punch = gap_of(Punch(1.0, 0.1, 3.0))
    assert punch is not None
    np.testing.assert_allclose(punch.look(np.array([[0.5, 0.0, -0.2]]))[2], 0.0)
    assert punch.gap(np.array([[1.0 + 0.3, 0.0, 0.1 - 0.4]]))[0] == pytest.approx(math.hypot(0.4, 0.4) - 0.1)


def test_a_rounding_begins_at_its_first_nanometre() -> None:
    """Past the flat of a punch its normal leans with the first digit: it stood upright for 1e-6 of the radius."""
    own = gap_of(Punch(5.0, 1.0, 10.0))
    assert own is not None
    past = np.array([1e-8, 1e-7, 1e-6, 1e-5])
    X = np.stack([4.0 + past, 0.0 * past, 0.0 * past - 0.1], axis=1)
    _, n, H = own.look(X)
    np.testing.assert_allclose(n[:, 0], past / 1.1, rtol=1e-6)  # digits of 4.0, over 1e-8
    np.testing.assert_allclose(H[:, 0, 0], 1.0 / 1.1, rtol=1e-6)


@pytest.mark.parametrize("kind", ALL)
def test_edges_tips_axes_and_middles_have_finite_values(kind: str) -> None:
    """Where there is no gradient, one of those next to it; points lie on corners exactly."""
    own, shape = gap(kind), KINDS.get(kind)
    axis, X = np.array(AXIS), [np.zeros(3), np.array(own.centroid or (0.0, 0.0, 0.0))]
    if shape is not None and hasattr(shape, "origin"):
        X += [np.array(shape.origin) + s * axis for s in (-1.0, 0.0, 0.2, 0.5, 1.0, 2.0, 3.0)]
        X += [np.array(end) for end in shape.bounds or ()]
    if isinstance(own, TriangleSurface):
        X += [*own.points, *own.corners.mean(axis=1), *(0.5 * (own.corners[:, 0] + own.corners[:, 1]))]
    g, n, H = own.look(np.array(X))
    assert np.isfinite(g).all()
    assert np.isfinite(H).all()
    np.testing.assert_allclose(np.linalg.norm(n, axis=1), 1.0, rtol=1e-12)


def test_how_sharp() -> None:
    """The least radius of what may cut into a facet."""
    known = {
        "half_space": math.inf,
        "sphere": 1.0,
        "box": 0.0,
        "rounded_box": 0.2,
        "punch": 0.2,
        "tip": 0.2,
        "cone": 0.0,
    }
    assert {kind: gap(kind).least_curvature_radius for kind in known} == pytest.approx(known)
    ball = TriangleSurface(*Sphere(1.0).surface(0.1)).least_curvature_radius
    assert 0.2 < ball < 1.5, "of what triangles stand for, by their narrowest pair"
    assert TriangleSurface(*BRICK.surface(0.5)).least_curvature_radius == 0.0


# ------------------------------------------------------------------ which shapes have one


def test_every_shape_has_a_gap_or_is_known_to_have_none() -> None:
    assert {name for name, cls in SHAPES.items() if not issubclass(cls, tuple(GAPS))} == WITHOUT
    assert all(issubclass(cls, tuple(GAPS)) for cls in SHAPES.values() if not cls.meshed), "else nobody could use it"
    tried = {type(shape) for shape in KINDS.values()}
    assert {name for name, cls in SHAPES.items() if not (cls.meshed or cls in tried)} == set(), "add them to KINDS"
    assert gap_of(Ellipsoid((1.0, 2.0, 3.0))) is None
    assert gap_of(Sphere(1.0, part="half")) is None
    assert gap_of(Punch(1.0, 1.0, 3.0)) is None, "its rims meet"


# ------------------------------------------------------------------ surfaces of triangles


@pytest.mark.parametrize("word", ["tetrahedralized", "mesh"])
def test_a_box_in_a_file_is_that_box(word: str, tmp_path: Path) -> None:
    """To rounding: its corners are numbers that the file's single precision holds."""
    import trimesh

    trimesh.creation.box(BRICK.size).export(tmp_path / "box.stl")
    own = gap_of(SHAPES[word](str(tmp_path / "box.stl"), 1.0))  # type: ignore[call-arg]
    assert own is not None
    X = places(8)
    g, n, H = own.look(X)
    there, normal, hessian = gap("box").look(X)
    np.testing.assert_allclose(g, there, atol=1e-14)
    np.testing.assert_allclose(n, normal, atol=1e-12)
    np.testing.assert_allclose(H, hessian, atol=1e-9)
    assert own.centroid == pytest.approx((0.0, 0.0, 0.0), abs=1e-14)


@pytest.mark.parametrize("kind", SURFACES)
def test_the_closest_triangle_is_the_closest_of_all(kind: str) -> None:
    """By the points that all pairs give."""
    own, X = gap(kind), places(9, 300)
    assert isinstance(own, TriangleSurface)
    far = closest_points(X, own.points, own.triangles, 10.0)[1]
    np.testing.assert_allclose(np.abs(own.gap(X)), far, atol=1e-14)


def test_a_finer_surface_of_a_ball_comes_to_the_ball() -> None:
    """Facets are inscribed by h^2 / 8 R: the gap exceeds that to the ball by no more, inside and out."""
    X, away = places(10), []
    for size in (0.4, 0.2):
        own = TriangleSurface(*Sphere(1.0).surface(size))
        more = own.gap(X) - (np.linalg.norm(X, axis=1) - 1.0)
        assert more.min() > -1e-12
        away.append(more.max())
    assert away[0] / away[1] == pytest.approx(4.0, rel=0.3)


def test_a_file_without_an_inside_says_so(tmp_path: Path) -> None:
    """Nothing at all, a box without a lid, and two boxes that pass through each other."""
    import trimesh

    (tmp_path / "no.stl").write_text("solid nothing\nendsolid nothing\n")
    whole, other = trimesh.creation.box((2.0, 1.0, 1.5)), trimesh.creation.box((1.0, 2.0, 1.0))
    trimesh.Trimesh(whole.vertices, whole.faces[:-2]).export(tmp_path / "open.stl")
    trimesh.util.concatenate([whole, other]).export(tmp_path / "crossing.stl")
    for name in ("no", "open", "crossing"):
        with pytest.raises(UnreadableMesh):
            gap_of(MeshFile(str(tmp_path / f"{name}.stl"), 1.0))


@pytest.mark.skipif(find_spec("manifold3d") is None, reason="needs the extra `solids`")
def test_a_box_with_a_bore_is_what_remains() -> None:
    """A box of 2 x 2 x 1 with a bore of radius 0.5, of facets 0.05 long: 0.05^2 / (8 x 0.5) = 6e-4 is cut off."""
    bored = SHAPES["difference"](
        Box((2.0, 2.0, 1.0)), Cylinder(2.0, 0.5, (0.0, 0.0, 1.0), (1.0, 1.0, -0.5)), facets=0.05
    )  # type: ignore[call-arg]
    own = gap_of(bored)
    assert own is not None
    X = np.array([[1.0, 1.0, 0.5], [1.2, 1.0, 0.5], [2.5, 1.0, 0.5], [1.0, 1.7, 0.5]])
    np.testing.assert_allclose(own.gap(X), [0.5, 0.3, 0.5, -0.2], atol=1e-3)


# ------------------------------------------------------------------ poses


def test_a_pose_turns_about_its_point() -> None:
    """Against scipy's rotation; and back again."""
    from scipy.spatial.transform import Rotation

    pose, X = RigidMotion((1.0, 2.0, 3.0), (0.3, -0.5, 0.9), (0.5, 0.0, -1.0)), places(11, 50)
    c = np.array(pose.about)
    x = Rotation.from_rotvec(pose.rotation).apply(X - c) + c + np.array(pose.shift)
    np.testing.assert_allclose(pose.moved(X), x, atol=1e-14)
    np.testing.assert_allclose(pose.back(x), X, atol=1e-14)
    half = pose.at(0.5)
    again = RigidMotion((0.0, 0.0, 0.0), half.rotation, half.about).moved(
        RigidMotion((0.0, 0.0, 0.0), half.rotation, half.about).moved(X)
    )
    np.testing.assert_allclose(again + np.array(pose.shift), x, atol=1e-14)
    np.testing.assert_allclose(RigidMotion((1.0, 0.0, 0.0)).back(X), X - [1.0, 0.0, 0.0])
    np.testing.assert_allclose(
        RigidMotion(rotation=(1e-9, 0.0, 0.0)).moved(X), X + 1e-9 * np.cross([1.0, 0.0, 0.0], X), atol=1e-16
    )


def test_a_shape_that_is_turned_is_the_shape_declared_so() -> None:
    """A cone along z that is turned by 90 degrees about x lies along -y; with look's tensors."""
    upright = gap_of(Cone(2.0, 0.9, 0.3, (0.0, 0.0, 1.0), (0.2, 0.0, 0.0)))
    lying = gap_of(Cone(2.0, 0.9, 0.3, (0.0, -1.0, 0.0), (1.2, 1.0, 2.0)))
    assert upright is not None
    assert lying is not None
    posed, X = MovedGap(upright, RigidMotion((1.0, 1.0, 2.0), (0.5 * math.pi, 0.0, 0.0))), places(12)
    for found, known in zip(posed.look(X), lying.look(X), strict=True):
        np.testing.assert_allclose(found, known, atol=1e-9)  # of a Hessian at 1e-3 of an edge
    np.testing.assert_allclose(posed.gap(X), lying.gap(X), atol=1e-14)
    assert posed.centroid == pytest.approx(lying.centroid)
    assert posed.least_curvature_radius == lying.least_curvature_radius


@pytest.mark.parametrize("kind", ALL)
def test_turned_gaps_keep_the_laws(kind: str) -> None:
    own, X = MovedGap(gap(kind), RigidMotion((0.1, -0.2, 0.3), (0.7, 0.2, -0.4), (0.3, 0.0, 0.1))), places(13, 1000)
    far = smooth(own, X)
    g, n, H = own.look(far)
    np.testing.assert_allclose(g, own.gap(far), atol=1e-14)
    ends = [(own.look(far + STEP * e), own.look(far - STEP * e)) for e in np.eye(3)]
    np.testing.assert_allclose(n, np.stack([(a[0] - b[0]) / (2.0 * STEP) for a, b in ends], axis=1), atol=1e-8)
    np.testing.assert_allclose(H, np.stack([(a[1] - b[1]) / (2.0 * STEP) for a, b in ends], axis=2), atol=1e-5)

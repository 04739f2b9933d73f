"""Perturbed states far from rest, to test recovery: scrambled, flattened, collapsed, inverted, spun.

To add a kind of perturbation, write a function of a body and a random number generator, and add one line to
DISTURBANCES.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from softmark.records import dataclass
from softmark.solvers.energies.energy import Floats, Ints

TURNS = 3.0  # whole turns of the twist for an amount of 1


@dataclass(frozen=True)
class PerturbedNodes:
    """Nodes of a body to perturb: `points` (n, 3), m, at rest, and the `cells` (m, a) that connect them.

    `amount` is the strength of the perturbation; it scales the perturbed positions.
    """

    points: Floats
    cells: Ints
    amount: float = 1.0

    @property
    def low(self) -> Floats:
        """Lower corner of the bounding box (3,), m."""
        corner: Floats = self.points.min(axis=0)
        return corner

    @property
    def size(self) -> Floats:
        """Edge lengths of the bounding box (3,), m."""
        edges: Floats = np.ptp(self.points, axis=0)
        return edges

    @property
    def middle(self) -> Floats:
        """Centre of the bounding box (3,), m."""
        return self.low + 0.5 * self.size


Random = np.random.Generator


def scramble_nodes(body: PerturbedNodes, random: Random) -> Floats:
    """Return random positions (n, 3), m, of the nodes in their bounding box, scaled by `body.amount`."""
    # a straight line of nodes gets a box as thick as a tenth of its length
    size = np.maximum(body.size, 0.1 * body.size.max())
    places: Floats = body.middle + body.amount * size * random.uniform(-0.5, 0.5, body.points.shape)
    return places


def flatten_nodes(body: PerturbedNodes, random: Random) -> Floats:
    """Return positions (n, 3), m, projected onto a random plane through the centre, and scaled by `body.amount`."""
    n = _random_direction(random)
    away = body.points - body.middle
    places: Floats = body.middle + body.amount * (away - np.outer(away @ n, n))
    return places


def collapse_nodes(body: PerturbedNodes, random: Random) -> Floats:
    """Return positions (n, 3), m, of all nodes at one random point, or on one random line, scaled by `body.amount`.

    The point lies in the bounding box; point and line are equally likely.
    """
    n, line = _random_direction(random), random.random() < 0.5
    point = body.low + random.random(3) * body.size
    along = (body.points - body.middle) @ n
    places: Floats = point + (body.amount * np.outer(along, n) if line else np.zeros_like(body.points))
    return places


def invert_cells(body: PerturbedNodes, random: Random) -> Floats:
    """Return positions (n, 3), m, reflected by a random plane through the centre, and scaled by `body.amount`.

    The reflection inverts every cell.
    """
    n = _random_direction(random)
    away = body.points - body.middle
    places: Floats = body.middle + body.amount * (away - 2.0 * np.outer(away @ n, n))
    return places


def spin_cells(body: PerturbedNodes, random: Random) -> Floats:
    """Return positions (n, 3), m, with every cell rotated at random, and the whole body twisted.

    Each cell rotates about its centre, and a node gets the average position from its cells. The body is twisted about
    its longest direction, by TURNS x `body.amount` whole turns from end to end, in a random sense.
    """
    corners = body.points[body.cells]
    middles = corners.mean(axis=1, keepdims=True)
    turned = middles + (corners - middles) @ random_rotations(len(corners), random)
    places = np.zeros_like(body.points)
    np.add.at(places, body.cells, turned)
    count = np.bincount(body.cells.ravel(), minlength=len(places))
    return _twist_nodes(body, places / np.maximum(count, 1)[:, None], random)


def _twist_nodes(body: PerturbedNodes, places: Floats, random: Random) -> Floats:
    """Return the positions `places` (n, 3), m, twisted about the body's longest direction.

    The twist is TURNS x `body.amount` whole turns from end to end, in a random sense.
    """
    axis = int(np.argmax(body.size))
    b, c = (axis + 1) % 3, (axis + 2) % 3
    sense = TURNS * body.amount * random.choice([-1.0, 1.0])
    angle = 2.0 * np.pi * sense * (body.points[:, axis] - body.low[axis]) / body.size[axis]
    p, q = (places - body.middle)[:, [b, c]].T
    places[:, b] = body.middle[b] + np.cos(angle) * p - np.sin(angle) * q
    places[:, c] = body.middle[c] + np.sin(angle) * p + np.cos(angle) * q
    return places


def random_rotations(count: int, random: Random) -> Floats:
    """Return uniformly random rotations (count, 3, 3), from normal unit quaternions (Shoemake 1992)."""
    q = random.standard_normal((count, 4))
    w, x, y, z = (q / np.linalg.norm(q, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.ascontiguousarray(np.array(rows).transpose(2, 0, 1))


def _random_direction(random: Random) -> Floats:
    """Return a random unit vector (3,)."""
    n = random.standard_normal(3)
    unit: Floats = n / np.linalg.norm(n)
    return unit


DISTURBANCES: dict[str, Callable[[PerturbedNodes, Random], Floats]] = {
    "scrambled": scramble_nodes,
    "flattened": flatten_nodes,
    "collapsed": collapse_nodes,
    "inverted": invert_cells,
    "spun": spin_cells,
}


def perturb(kind: str, body: PerturbedNodes, seed: int) -> Floats:
    """Return perturbed positions (n, 3), m, of the nodes; they depend only on kind, body and seed.

    Raises KeyError for an unknown kind.
    """
    return DISTURBANCES[kind](body, np.random.default_rng(seed))

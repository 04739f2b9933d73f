"""What one state of a material point costs: CPU over a sweep, by plain numbers and by arrays, in one run.

    python tests/benchmarks/points.py [STATES]

Every law with constants of its own and three others, in five states, each swept from 0.8 to 1.4 (shear: -0.2 to 0.4) at
a Poisson's ratio of 0.45 and of 0.5; the first state of each is not counted. Microseconds of CPU for a state; the ratio
is of all sweeps. `arrays` is the way that laws with directions take. Measured; tests/solvers/test_principal_axes_law.py
asserts a part of it, and that both find the same.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import numpy as np

from softmark.solvers.materials import law_for, mixed_for
from softmark.solvers.statics.material_point import ImposedDeformation, MaterialPoint, NoState
from tests.shared.equal_moduli import CONSTANTS, made

FREE = float("nan")
LAWS = ("neo_hookean", "neo_hookean_isochoric", "stable_neo_hookean", *CONSTANTS)
STATES = {
    "uniaxial": lambda l: ImposedDeformation(np.array([l, FREE, FREE])),
    "equibiaxial": lambda l: ImposedDeformation(np.array([l, l, FREE]), driven=(0, 1)),
    "planar": lambda l: ImposedDeformation(np.array([l, 1.0, FREE])),
    "confined": lambda l: ImposedDeformation(np.array([l, 1.0, 1.0])),
    "simple_shear": lambda l: ImposedDeformation(np.ones(3), shear=(0, 1, l - 1.0)),
}  # fmt: skip


class Tensors:
    """A law that does not say that it knows principal axes."""

    def __init__(self, law: Any) -> None:
        self.psi, self.P, self.dPdF = law.psi, law.P, law.dPdF


def point(name: str, nu: float, arrays: bool) -> MaterialPoint:
    """A point of a material."""
    own = made(name, 60e3, nu)
    split = mixed_for(own, "finite") if own.incompressible else None
    law = law_for(own, "finite") if split is None else split.shape
    return MaterialPoint(Tensors(law) if arrays else law, None if split is None else split.constraint)


def spent(one: MaterialPoint, drives: list[ImposedDeformation]) -> float:
    """CPU of a state, us."""
    one.state(drives[0])
    start = time.process_time()
    for drive in drives:
        one.state(drive)
    return 1e6 * (time.process_time() - start) / len(drives)


def main(states: int) -> None:
    """Print the table."""
    whole = [0.0, 0.0]
    print(f"{'us of CPU a state':36s}" + "".join(f"{name:>18s}" for name in STATES))
    for nu in (0.45, 0.5):
        for name in LAWS:
            cells = []
            for made_of in STATES.values():
                drives = [made_of(l) for l in np.linspace(0.8, 1.4, states)]
                try:
                    both = (
                        spent(point(name, nu, False), drives),
                        spent(point(name, nu, True), drives[:: max(1, states // 20)]),
                    )
                except NoState:
                    cells.append(f"{'no state':>18s}")
                    continue
                whole = [a + b for a, b in zip(whole, both, strict=True)]
                cells.append(f"{both[0]:9.0f} of {both[1]:5.0f}")
            print(f"{name:28s} {nu:<6g} " + " ".join(f"{cell:>17s}" for cell in cells))
    print(f"by numbers {whole[1] / whole[0]:.1f} times as fast as by arrays")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)

"""Constants of the library's own fits, from measured curves, with what is left of each: a study, needs SOFTMARK_DATA.

    SOFTMARK_DATA=... python tests/benchmarks/fits.py

Ecoflex 00-30: one strip pulled to failure (Marechal et al. 2021, ODbL 1.0) and ten cylinders pressed (Dawood et al.
2026, CC BY 4.0). Least squares of nominal stresses, as of a solid that keeps its volume, ends that slide, over all
points of a range of stretches; of cylinders the mean curve of the ten. A constant's uncertainty is its deviation among
repeats, or what it becomes as the range is another. tests/interpreter/test_library.py holds the library's constants
against these fits, and its curves against the points.
"""

from __future__ import annotations

import csv
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

Floats = NDArray[np.float64]
REPEATS = [f"{batch}{n}" for batch in "AB" for n in range(1, 6)]
GRID = np.arange(0.02, 0.65, 0.01)  # compressive strains at which repeats are averaged


def folder() -> Path:
    """Where the measured data lie. Raises KeyError where nothing says it."""
    return Path(os.environ["SOFTMARK_DATA"]) / "ecoflex-0030"


def pulled() -> tuple[Floats, Floats]:
    """Stretches and nominal stresses of the strip (n,), Pa."""
    with (folder() / "ecoflex0030_tension_ODbL.csv").open(encoding="utf-8-sig", newline="") as file:
        rows = [row for row in csv.reader(file, delimiter=";") if len(row) > 4 and row[4]]
    values = np.array([[float(row[3]), float(row[4])] for row in rows if row[3] != "Engineering Strain"])
    return 1.0 + values[:, 0], 1e6 * values[:, 1]


def pressed() -> tuple[Floats, Floats]:
    """Stretches (n,), and nominal stresses of ten cylinders (10, n), Pa."""
    found = []
    for repeat in REPEATS:
        text = (folder() / "compression" / f"EF30_{repeat}.csv").read_text(encoding="utf-8-sig")
        rows = [line.split(",") for line in text.splitlines() if line[:1].isdigit() and line.count(",") == 6]
        values = np.array(rows, dtype=np.float64)
        values = values[: int(values[:, 1].argmax()) + 1]
        found.append(np.interp(GRID, -values[:, 3], 1e3 * values[:, 4]))
    return 1.0 - GRID, np.array(found)


def of_yeoh(c: Floats, l: Floats) -> Floats:
    """Nominal stress of a pull to l, of constants in Pa: 2 (l - l^-2) W'."""
    i = l * l + 2.0 / l - 3.0
    found: Floats = 2.0 * (l - l**-2) * (c[0] + 2.0 * c[1] * i + 3.0 * c[2] * i * i)
    return found


def of_gent(c: Floats, l: Floats) -> Floats:
    """The same of mu, Pa, and the limit."""
    found: Floats = c[0] * (l - l**-2) / (1.0 - (l * l + 2.0 / l - 3.0) / c[1])
    return found


def of_ogden(c: Floats, l: Floats) -> Floats:
    """The same of pairs of mu, Pa, and alpha."""
    found: Floats = sum(m * (l ** (a - 1.0) - l ** (-0.5 * a - 1.0)) for m, a in zip(c[::2], c[1::2], strict=True))
    return found


def fitted(law: Callable[[Floats, Floats], Floats], start: list[float], l: Floats, P: Floats) -> Floats:
    """The constants that leave least of the stresses P at l, Pa."""
    scale = np.array([abs(s) for s in start])
    found: Floats = (
        scale
        * least_squares(
            lambda c: law(scale * c, l) - P, np.array(start) / scale, xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=10000
        ).x
    )
    return found


PULLS = {  # law, where to start, the largest stretch
    "gent": (of_gent, [17e3, 60.0], 4.0),
    "ogden": (of_ogden, [14e3, 2.0, 4e2, 3.8], 9.0),
}
PRESS = (of_yeoh, [16e3, -2e3, 1e3], 0.55)  # and the least


def of_pull(name: str, far: float | None = None) -> tuple[Floats, Floats, Floats, Floats]:
    """Constants, stretches, stresses and what the law has there, Pa, up to a stretch."""
    law, start, most = PULLS[name]
    l, P = pulled()
    some = l <= (far or most)
    c = fitted(law, start, l[some], P[some])
    return c, l[some], P[some], law(c, l[some])


def of_press(far: float = PRESS[2]) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """The same of the mean of cylinders, down to a stretch, and the deviation of each constant among the ten."""
    law, start, _ = PRESS
    l, P = pressed()
    some = l >= far - 1e-9
    mean = P.mean(axis=0)[some]
    c = fitted(law, start, l[some], mean)
    each = np.array([fitted(law, start, l[some], one[some]) for one in P])
    return c, l[some], mean, law(c, l[some]), each.std(axis=0, ddof=1)


def _said(name: str, c: Floats, l: Floats, P: Floats, Q: Floats) -> None:
    rms = float(np.sqrt(((Q - P) ** 2).mean()))
    print(f"{name}: {', '.join(f'{x:.6g}' for x in c)}; stretches {l.min():.3g} to {l.max():.3g}; rms {rms:.0f} Pa")
    order = np.argsort(l)
    at = [t for t in (0.56, 0.7, 0.8, 0.92, 1.3, 1.5, 2.0, 3.0, 4.0, 6.0, 9.0) if l.min() <= t <= l.max()]
    off = [np.interp(t, l[order], Q[order]) / np.interp(t, l[order], P[order]) - 1.0 for t in at]
    print("   " + "  ".join(f"{t:g}: {100.0 * o:+.1f} %" for t, o in zip(at, off, strict=True)))


def main() -> None:
    """Print all fits."""
    for name, (_, _, most) in PULLS.items():
        for far in (0.6 * most, most):
            _said(f"pull, {name}", *of_pull(name, far))
    c, l, P, Q, deviation = of_press()
    _said("press, yeoh", c, l, P, Q)
    print("   deviation among ten:", ", ".join(f"{d:.3g}" for d in deviation))
    mean = pressed()[1].mean(axis=0)
    published = np.array([14.690e3, -0.19438e3, 0.31075e3])
    _said("press, yeoh as published", published, 1.0 - GRID, mean, of_yeoh(published, 1.0 - GRID))


if __name__ == "__main__":
    main()

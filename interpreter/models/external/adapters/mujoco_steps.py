"""Time stepping of a MuJoCo model."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from softmark.interpreter.models.external.external_problem import ExternalNotConverged, Floats, Motion


def take_steps(model: Any, data: Any, motion: Motion, look: Callable[[int], None]) -> tuple[Floats, int]:
    """Return the seconds that each step took, and the number of steps that reached the iteration limit.

    `look(i)` is called when state i of the requested states is reached. Raises ExternalNotConverged if MuJoCo
    reports bad values, or if values are not finite.
    """
    import mujoco

    wanted, warned = {int(n): i for i, n in enumerate(motion.after)}, mujoco.mjtWarning
    bad = [int(w) for w in (warned.mjWARN_BADQPOS, warned.mjWARN_BADQVEL, warned.mjWARN_BADQACC)]
    steps, short, unsolved = np.empty(motion.count), data.warning[int(warned.mjWARN_INERTIA)], 0
    for n in range(motion.count):
        before = time.perf_counter()
        mujoco.mj_step(model, data)
        steps[n] = time.perf_counter() - before
        unsolved, short.number = unsolved + bool(short.number), 0
        if any(data.warning[w].number for w in bad) or not np.all(np.isfinite(data.qpos)):
            raise ExternalNotConverged(
                f"it becomes unstable after {(n + 1) * motion.step:.4g} s with steps of {motion.step:g} s"
            )
        if n + 1 in wanted:
            look(wanted[n + 1])
    return steps, unsolved

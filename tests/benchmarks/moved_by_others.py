"""What programs of real time make of the silicone beam: error against time a step, beside ours, at five settings each.

    python tests/benchmarks/moved_by_others.py [release|hang] [--only NAME ...] [--size "15 mm"] [--poisson 0.49]

`hang`: the beam of 2008 falls from straight and is damped for 2 s until it hangs (10 / s in proportion to the mass).
`release`: it falls for 0.4 s and swings undamped, down and up again.
All move the same linear tetrahedra with the same lumped masses under the same forces. Truth is their motion by our
trapezoidal steps of 0.5 ms with the neo-Hookean law; `law` is how far St Venant's and Kirchhoff's, which is MuJoCo's,
is from it by the same steps; Newton's law is a third. Error: root mean square of the distance of 41 points of the axis
over the course, of the same of their way, of MuJoCo also against the motion of its own law; then that of the tip at the
end. Time: wall clock of a step by the program's own clock, one thread, median, and of the time that passes in a step:
below 100 % it keeps up.

MEASURED
"""

from __future__ import annotations

import argparse
import statistics
from typing import Any

import numpy as np

import softmark
from softmark.interpreter.run import pipeline

SCENE = """softmark 1
scene "moved by others"
material silicone = {law}(young = 60 kPa, poisson = {nu}, density = 1070 kg/m^3)
body beam = solid(cylinder(length = 178 mm, radius = 19 mm, axis = +x), silicone)
support wall = fixed(beam, where = x <= 0 mm)
load weight = gravity(9.81 m/s^2, direction = -z)
analysis fall = dynamic(duration = {duration}, step = {step}, integrator = {integrator}, damping_mass = {damping} Hz)
probe axis = line(beam, from = (0, 0, 0) mm, to = (178, 0, 0) mm, points = 41)
metric sag = displacement(axis, along = -z)
model one = {model}
"""
CASES = {"release": ("0.4 s", "0"), "hang": ("2 s", "10")}
STEPS = ("20 ms", "10 ms", "5 ms", "2 ms", "1 ms")
SWEEPS = (2, 5, 10, 20, 50)
FEW = (("2 ms", 10), ("0.5 ms", 10), ("0.2 ms", 10), ("0.1 ms", 10), ("0.1 ms", 50))
LIMITS = "time = 600 s, memory = 16"


def settings(size: str) -> dict[str, list[tuple[str, str]]]:
    """By name: the step and the words of each model."""
    fem = f"fem(tet4, size = {size}, mass = lumped"
    of = f"tet4, strain = finite, size = {size}, {LIMITS}"
    return {
        "ours": [(step, f"{fem}, strain = finite)") for step in STEPS],
        "ours, turning": [(step, f"{fem}, strain = corotational)") for step in STEPS],
        "ours, one iteration": [(step, f"{fem}, strain = corotational, cap = 1)") for step in STEPS],
        "mujoco": [(step, f"outside(mujoco, {of}, iterations = 1000)") for step in STEPS],
        "mujoco, few": [("2 ms", f"outside(mujoco, {of}, iterations = {n})") for n in SWEEPS],
        "newton_vbd": [("2 ms", f"outside(newton_vbd, {of}, iterations = {n})") for n in SWEEPS],
        "newton_xpbd": [(step, f"outside(newton_xpbd, {of}, iterations = {n})") for step, n in FEW],
    }


def moved(case: str, nu: float, step: str, model: str, law: str = "neo_hookean", by: str = "implicit_euler") -> Any:
    """The result of one model."""
    duration, damping = CASES[case]
    known = {"law": law, "nu": nu, "step": step, "integrator": by, "duration": duration, "damping": damping}
    loaded = softmark.loads(SCENE.format(model=model, **known))
    return pipeline.run(loaded.scene, [], pipeline.Options(draw=False)).models["one"]


def course(result: Any) -> tuple[Any, Any]:
    """Times (t,), s, and displacements (t, 41, 3), m, of the axis."""
    probe = result.probes["axis"]
    return np.asarray(probe.times), np.asarray(probe.course)


def apart(result: Any, truth: Any) -> tuple[float, float]:
    """How far the course is from the truth, relative, and the tip at its end, m."""
    t, right = course(truth)
    times, u = course(result)
    flat = u.reshape(len(times), -1)
    at = np.stack([np.interp(t, times, column) for column in flat.T], axis=1).reshape(right.shape)
    error = np.sqrt(((at - right) ** 2).sum() / (right**2).sum())
    return float(error), float(np.linalg.norm(at[-1, -1] - right[-1, -1]))


def main() -> None:
    """A line for each model and setting."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("case", nargs="?", default="release", choices=list(CASES))
    parser.add_argument("--only", nargs="*", default=None)
    parser.add_argument("--size", default="15 mm")
    parser.add_argument("--poisson", type=float, default=0.49)
    asked = parser.parse_args()
    case, nu = asked.case, asked.poisson
    fem = f"fem(tet4, strain = finite, size = {asked.size}, mass = lumped)"
    truth = moved(case, nu, "0.5 ms", fem, by="trapezoidal")
    print(f"{case}, nu = {nu}, {truth.size['dofs']} unknowns; tip at the end {course(truth)[1][-1, -1] * 1e3} mm")
    kirchhoff = moved(case, nu, "0.5 ms", fem, "st_venant_kirchhoff", "trapezoidal")
    for name, other in (("steps of 1 ms", moved(case, nu, "1 ms", fem, by="trapezoidal")), ("law", kirchhoff)):
        error, end = apart(other, truth)
        print(f"{name:20} {100 * error:7.3f} % {1e3 * end:7.2f} mm", flush=True)
    for name, models in settings(asked.size).items():
        for step, model in models if asked.only is None or name in asked.only else ():
            result = moved(case, nu, step, model)
            words = f"{name:20} {step:>6} {model.partition('iterations = ')[2].rstrip(')'):>4}"
            if "axis" not in result.probes:
                print(f"{words} {result.status}: {(result.message or '')[:90]}", flush=True)
                continue
            error, end = apart(result, truth)
            each = statistics.median(result.time["step_s"].seconds)
            real = each / (1e-3 * float(step.split()[0]))
            own = f"{100 * apart(result, kirchhoff)[0]:7.2f} %" if name.startswith("mujoco") else " " * 9
            told = f"{100 * error:9.2f} % {own} {1e3 * end:8.2f} mm {1e3 * each:8.3f} ms {100 * real:6.0f} %"
            print(f"{words} {told} {result.status}", flush=True)


if __name__ == "__main__":
    main()

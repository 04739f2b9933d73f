"""Estimated error that the time step causes in each metric of a dynamic analysis.

Each metric has an estimate of its own, by those vibrations that move its points in its direction
(solvers/dynamics/time_step_error.py), and not by the slowest vibration of the body.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from softmark.grammar.diagnostic import Diagnostic
from softmark.interpreter.language import units
from softmark.interpreter.language.compiled_scene import Declared, Scene
from softmark.interpreter.language.message_builder import diagnostic
from softmark.interpreter.language.number_formatting import round_significant
from softmark.interpreter.metrics.metric_base import DisplacementMetric, Metric
from softmark.interpreter.problem.solution import View
from softmark.interpreter.vocabulary.analysis_words import Dynamic
from softmark.records import dataclass
from softmark.solvers.dynamics.time_step_resolution import WRONG

if TYPE_CHECKING:
    from softmark.interpreter.problem.body_case import Case
    from softmark.interpreter.results.run_report import ProbeResult

Floats = Any
FADED = 3.0  # decay exponent of vibrations: 5 % of the amplitude are left
UNSEEN = 1e-3  # relative to the motion: components with less vibration are not judged
RESOLVED = "W362"  # warning about the slowest vibration, which is sufficient


@dataclass(frozen=True)
class MetricError:
    """Time-step error of a metric: relative to the largest value of the metric over time, and in m if it is a length.

    `period`, s, is the period of the vibration that contributes most to the error.
    """

    relative: float
    period: float  # s, of the vibration that contributes most
    length: float | None = None  # m


def has_fading_vibrations(case: Case) -> bool:
    """Return whether fast vibrations of every material lose most of their amplitude during a dynamic analysis.

    Each branch of a Prony series damps vibrations that are faster than its relaxation: they decay as
    exp(-g t / (2 tau)), from the loss modulus g / (omega tau).
    """
    analysis: Any = case.analysis
    rates = [sum(g / (2.0 * tau) for g, tau in getattr(material, "branches", ())) for material in case.materials]
    return bool(rates) and min(rates) * analysis.duration > FADED


def time_step_error_of(view: View, metric: Metric | None, probe: ProbeResult | None) -> MetricError | None:
    """Return the estimated time-step error of a metric, or of the motion of a probe; None if it is not known."""
    if view.step_errors is None or (found := view.step_errors()) is None:
        return None
    modes = found.modes
    at_end = metric is not None and (isinstance(metric, DisplacementMetric) or metric.direction is not None)
    if probe is None or probe.course is None or probe.times is None or not _is_about_motion(metric):
        own, off = modes.motion * modes.frequencies, modes.error * modes.frequencies
        most = float(np.linalg.norm(own, axis=1).max(initial=0.0))
        if most == 0.0:
            return None
        return MetricError(float(np.linalg.norm(off[-1])) / most, _dominant_period(modes.frequencies, np.abs(off[-1])))
    last = metric is not None and metric.last
    X, u = (probe.points[-1:], probe.course[:, -1:]) if last else (probe.points, probe.course)
    along = None if metric is None else metric.direction
    shapes = [_component_along(np.asarray(shape(X)), along) for shape in found.shapes]
    motion = sum(np.multiply.outer(q, s) for q, s in zip(modes.motion.T, shapes, strict=True))
    error = sum(np.multiply.outer(q, s) for q, s in zip(modes.error.T, shapes, strict=True))
    return _compare_motions(_component_along(np.asarray(u), along), motion, error, shapes, found.modes, at_end)


def _compare_motions(
    u: Floats, motion: Floats, error: Floats, shapes: Floats, modes: Any, at_end: bool
) -> MetricError | None:
    """Return the time-step error of a computed motion u (t, n, 3) or (t, n), m, from that of the linearised motion.

    `motion` and `error`, m, of the shape of u, are the sums over all modes of the linearised motion and of its error.
    `shapes` are the modes at the same points. The error is taken at the last time if `at_end`, else averaged over time.
    Returns None if vibrations are a negligible part of the motion.
    """
    own, swing = _largest_norm(motion), _largest_norm(u)
    if own <= UNSEEN * swing or swing == 0.0:
        return None
    off = float(np.linalg.norm(error[-1])) if at_end else float(np.sqrt((error**2).mean(axis=0).sum()))
    off = min(off, off / own * swing)  # a large motion may be smaller than the linear one, and its error with it
    each = [float(np.linalg.norm(s)) for s in shapes] * np.abs(modes.error if not at_end else modes.error[-1:]).max(
        axis=0
    )
    return MetricError(off / swing, _dominant_period(modes.frequencies, each), off)


def _is_about_motion(metric: Metric | None) -> bool:
    """Return whether the value of a metric follows from the motion of its points, judged by its class and unit."""
    return metric is None or isinstance(metric, DisplacementMetric) or metric.unit in ("m", "1", "s")


def _component_along(u: Floats, along: tuple[float, float, float] | None) -> Floats:
    """Return the component of displacements u (..., 3), m, along a unit vector; all components if it is None."""
    return u if along is None else u @ np.asarray(along)


def _largest_norm(u: Floats) -> float:
    """Return the largest norm of a motion u (t, ...) over all its times."""
    return float(np.sqrt((u.reshape(len(u), -1) ** 2).sum(axis=1)).max(initial=0.0))


def _dominant_period(frequencies: Floats, shares: Floats) -> float:
    """Return the period, s, of the vibration with the largest share, from angular frequencies (k,), rad/s."""
    return float(2.0 * np.pi / frequencies[int(np.argmax(shares))])


# ------------------------------------------------------------------ warnings


def time_step_warnings(
    scene: Scene, declared: Declared, view: View, notes: tuple[Diagnostic, ...]
) -> tuple[Diagnostic, ...]:
    """Return the warning W420 if the time step of a model causes too large errors in metrics; else an empty tuple.

    `notes` are the warnings about the model so far; W362 about the slowest vibration among them makes W420 superfluous.
    """
    analysis = view.case.analysis
    if not isinstance(analysis, Dynamic) or view.step_errors is None or any(n.code == RESOLVED for n in notes):
        return ()
    found = sorted(_time_step_errors(scene, view), key=lambda pair: -pair[1].relative)
    wrong = [(name, error) for name, error in found if error.relative > WRONG]
    if not wrong:
        return ()
    worst = wrong[0][1]
    period = units.format_value(round_significant(worst.period, 3), units.TIME)
    order = 1.0 if analysis.integrator == "implicit_euler" else 0.5
    better = units.format_value(
        round_significant(analysis.step * (0.5 * WRONG / min(worst.relative, 1.0)) ** order, 1), units.TIME
    )
    return (
        diagnostic(
            "W420",
            declared.at(),
            f"the time step of `{declared.name}` causes an error of "
            f"{' and '.join(map(_format_metric_error, wrong[:3]))}",
            f"a step of {units.format_value(analysis.step, units.TIME)}",
            f"vibrations with a period of {period} dominate, resolved by "
            f"{worst.period / analysis.step:.2g} steps per period: use a step of {better} or less",
        ),
    )


def _time_step_errors(scene: Scene, view: View) -> Iterator[tuple[str, MetricError]]:
    """Yield the name and the time-step error of each metric of the body; of each probe if the scene has no metrics."""
    metrics = scene.of_kind("metric")
    for name, metric in metrics.items():
        if metric.thing.body_in(scene) not in (None, view.body):
            continue
        probe = view.probes.get(metric.thing.probe_name or "")
        if (probe is not None or metric.thing.subject_name) and (
            found := time_step_error_of(view, metric.thing, probe)
        ) is not None:
            yield name, found
    if not metrics:
        for name, probe in view.probes.items():
            if (found := time_step_error_of(view, None, probe)) is not None:
                yield name, found


def _format_metric_error(pair: tuple[str, MetricError]) -> str:
    """Return the error of a named metric as text, such as "about 0.2 mm in `tip`, 3 % of its largest value"."""
    name, error = pair
    share = f"{100 * error.relative:.2g} % of its largest value"
    if error.length is None:
        return f"about {share} in `{name}`"
    return f"about {units.format_value(round_significant(error.length, 2), units.LENGTH)} in `{name}`, {share}"

"""Detection of disturbed timings, and summary of several timed runs of one job.

The functions use only plain values. A run is a record that `timed_process.py` writes. Disturbed runs are left out if
enough others are undisturbed. Otherwise all runs are kept and marked as contaminated.

The thresholds come from measurements on two virtual processors of an EPYC, with solutions of 20 to 80 ms. If the other
processor was idle or busy, one thread got 99.3 to 100 % of its processor, it waited for 0 to 0.7 % of the time, and
some task of the machine waited for 0 to 1.5 % of the time. With two to four tasks for two processors these numbers were
31 to 82 %, 10 to 70 % and 50 to 100 %. Wall times were then up to four times as long, while CPU times grew by up to a
tenth.

Involuntary switches are no criterion, because up to 160 a second caused no disturbance. The mean pressure of ten
seconds is recorded but not used, because it also covers the time before the run; the counter of the run itself shows
the same. No counter shows another guest on the same core of the host. CPU times and the pace of a fixed loop then grew
together, by half and more. Under a load of six, CPU times of 18 runs spread by 28 to 53 %, those of the 10 to 12 runs
at the usual pace by 7 to 11 % (quartiles over median, three models).
"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from softmark.interpreter.results.state_results import SOLVED

OWN, WHOLE = "own clock", "whole process"  # of an external program
FEWEST = 3  # minimum number of clean runs for a median

SHARE = 0.95  # CPU seconds per wall second of one thread
WAITED = 0.02  # fraction of the time waiting for a processor
PRESSURE = 0.05  # fraction of the time in which some task of the machine waited
STOLEN = 0.01  # fraction of the time that the hypervisor gave to others ...
TICKS = 0.02  # s ... and at least two of the ticks in which it is counted
SWITCHES = 1000.0  # a second: each costs some 10 us of cold caches; idle machines show up to 200
PACE = 0.15  # relative deviation from the processor speed of the compared runs

# why a run does not count
DISTURBANCES: dict[str, str] = {
    "shared": f"a thread had less than {100 * SHARE:g} % of a processor",
    "waited": f"it waited for a processor for more than {100 * WAITED:g} % of the time",
    "pressure": f"tasks of this machine waited for a processor for more than {100 * PRESSURE:g} % of the time",
    "stolen": f"the hypervisor took more than {100 * STOLEN:g} % of the time",
    "switched": f"it was preempted more than {SWITCHES:g} times a second",
    "pace": f"the processor was more than {100 * PACE:g} % faster or slower than in the other runs",
    "compiled": "kernels were compiled or loaded during the timing",
}
SLOWING = ("pace", "compiled")  # disturbances that also affect CPU times; waiting hardly does
# remarks on all runs
REMARKS: dict[str, str] = {
    "contaminated": "too few runs were undisturbed: times include all runs, and CPU time is more reliable",
    "few repeats": "one run takes long, so there are only few runs",
    "not warmed up": "a solution takes so long that the first one was timed",
    "runs differ": "runs differ in iterations or results",
    "differing processors": "runs used different processors",
    OWN: "the time is from the external program's own clock, without set-up and files",
    WHOLE: "the time is that of the external program's whole process, including files: an upper bound",
}

Record = Mapping[str, Any]
CostJson = dict[str, Any]  # what `point.Cost` is read from


def is_timed_solution(record: Record) -> bool:
    """Return whether the record of a run has a solution and its time."""
    return record.get("status") in SOLVED and bool(record.get("wall_s"))


def usual_pace(records: Iterable[Record]) -> float | None:
    """Return the CPU time, s, of the fixed piece of work that measures processor speed, on an undisturbed processor.

    It is the lower quartile over all runs of a comparison; None if no run has measured it.
    """
    paces = [float(p) for r in records if is_timed_solution(r) and (p := r.get("pace_s"))]
    return summarize_spread(paces)["q1"] if paces else None


def disturbances(record: Record, pace: float | None = None) -> list[str]:
    """Return the names of the disturbances during a run, which are keys of DISTURBANCES.

    `pace`, s, is the `usual_pace` of the compared runs. A counter that the system lacks counts as undisturbed.
    """
    seen = record.get("during") or {}
    wall = seen.get("wall_s") or 0.0
    if wall <= 0.0:
        return []
    one = (record.get("threads") or {}).get("asked", 1) == 1
    stolen = seen.get("steal_s") or 0.0
    own = record.get("pace_s") or 0.0
    found = {
        "shared": one and sum(record["cpu_s"]) < SHARE * sum(record["wall_s"]),
        "waited": (seen.get("waited_s") or 0.0) > WAITED * wall,
        "pressure": one and (seen.get("pressure_s") or 0.0) > PRESSURE * wall,
        "stolen": stolen > STOLEN * wall and stolen >= TICKS - 1e-9,
        "switched": (seen.get("involuntary") or 0) > SWITCHES * max(wall, 0.1),
        "pace": pace is not None and own > 0.0 and not own / (1 + PACE) <= pace <= own * (1 + PACE),
        "compiled": bool(seen.get("compiled")),
    }
    return [name for name, true in found.items() if true]


def is_undisturbed(record: Record, pace: float | None = None) -> bool:
    """Return whether the record of a run has a solution whose timing was not disturbed."""
    return is_timed_solution(record) and not disturbances(record, pace)


def reason_without_times(records: Sequence[Record]) -> str | None:
    """Return the reason why no run has a time, or None if one has."""
    if any(is_timed_solution(r) for r in records):
        return None
    bad = [r for r in records if r.get("status") not in SOLVED]
    return str(bad[-1].get("message") or bad[-1].get("status")) if bad else "it was not timed"


def summarize_cost(records: Sequence[Record], asked: int = FEWEST, pace: float | None = None) -> CostJson | None:
    """Return medians and quartiles of times over the undisturbed runs of one job; None if no run has a solution.

    `asked` is the number of undisturbed runs that were requested. `pace`, s, is the `usual_pace` of the whole
    comparison, by default that of these runs. If too few runs are undisturbed, wall times are taken from all
    runs, and CPU times from the runs at the usual pace, if these are enough.
    """
    runs = [r for r in records if is_timed_solution(r)]
    if not runs:
        return None
    pace = pace or usual_pace(runs)
    kept = [r for r in runs if not disturbances(r, pace)]
    contaminated = len(kept) < min(FEWEST, asked)
    used = runs if contaminated else kept
    steady = _undisturbed_runs(used, asked, pace)
    steps = _step_time_quantiles(used, "wall_s")
    wall, cpu = _solution_time_spread(used, "wall_s"), _solution_time_spread(steady, "cpu_s")
    step_cpu = _step_time_quantiles(steady, "cpu_s")
    by_cpu = contaminated and all((r.get("threads") or {}).get("asked", 1) == 1 for r in used)
    foreign = any(r.get("clock") for r in used)  # an external program has no known frame time
    frame, frame_cpu = steps or wall, step_cpu or cpu
    return {
        "wall_s": wall,
        "cpu_s": cpu,
        "step_s": steps,
        "step_cpu_s": step_cpu,
        "setup_s": summarize_spread([_setup_time(r, 0) for r in used]),
        "setup_cpu_s": summarize_spread([_setup_time(r, 1) for r in steady]),
        "phases": _phase_times(records, steady, cpu["median"]),
        "memory_bytes": _median_over_runs(used, lambda r: r["memory"].get("peak")),
        "memory_added_bytes": _median_over_runs(used, _added_memory),
        "frame_s": None if foreign else (frame_cpu if by_cpu else frame)["median"],
        "frame_basis": "cpu" if by_cpu else "wall",
        "flags": _flags(runs, used, contaminated, asked, pace),
        "contaminated": contaminated,
        "excluded_runs": len(runs) - len(used),
        "cores": sorted({c for r in used for c in r.get("cores") or []}),
    }


def _undisturbed_runs(runs: Sequence[Record], asked: int, pace: float | None) -> Sequence[Record]:
    """Return the runs whose CPU times are undisturbed, or all runs if these are too few."""
    kept = [r for r in runs if not set(SLOWING) & set(disturbances(r, pace))]
    return kept if len(kept) >= min(FEWEST, asked) else runs


def summarize_spread(values: Sequence[float]) -> dict[str, float | int]:
    """Return median, quartiles, minimum, maximum and number of some values.

    Quartiles are interpolated linearly between order statistics (type 7).
    Source: Hyndman and Fan 1996.
    """
    single = len(values) < 2
    q1, median, q3 = [values[0]] * 3 if single else statistics.quantiles(values, n=4, method="inclusive")
    return {"median": median, "q1": q1, "q3": q3, "min": min(values), "max": max(values), "runs": len(values)}


def _solution_time_spread(runs: Sequence[Record], name: str) -> dict[str, float | int]:
    """Return the spread over runs of the median time of each run.

    Only medians are used, because the solutions of one process are not independent.
    """
    return summarize_spread([statistics.median(r[name]) for r in runs])


def _step_time_quantiles(runs: Sequence[Record], name: str) -> dict[str, float | int] | None:
    """Return the quantiles of the time of a step, s, each as the median over all runs; None without steps."""
    known = [r["steps"] for r in runs if r.get("steps") and r["steps"].get(name)]
    if not known:
        return None
    quantiles = {q: statistics.median(k[name][q] for k in known) for q in known[0][name]}
    return {**quantiles, "steps": known[0]["steps"], "runs": len(known)}


def _setup_time(run: Record, clock: int) -> float:
    return float(run["setup"]["mesh"][clock] + run["setup"]["set-up"][clock])


def _added_memory(run: Record) -> float | None:
    """Return the memory, bytes, that building and solving the model added to that of the program."""
    peak, before = run["memory"].get("peak"), run["memory"].get("before")
    return None if peak is None or before is None else max(0, peak - before)


def _median_over_runs(runs: Sequence[Record], value: Callable[[Record], float | None]) -> int | None:
    known = [v for v in map(value, runs) if v is not None]
    return int(statistics.median(known)) if known else None


def _phase_times(records: Sequence[Record], used: Sequence[Record], median: float) -> dict[str, float]:
    """Return the CPU time of each phase of a solution, s, and of mesh, set-up and output.

    The clocks of phases slow the run that they measure. So only the proportions of phases are used, to divide `median`,
    the CPU time of a solution without these clocks, s.
    """
    made = {n: statistics.median(r["setup"][n][1] for r in used) for n in ("mesh", "set-up")}
    last = next((r for r in reversed(records) if r.get("phases")), None)
    if last is None:
        return made
    whole = sum(last["phases"].values())
    parts = {n: median * s / whole for n, s in last["phases"].items()} if whole > 0 else {}
    for name in ("assembly", "factorisation", "solution", "other"):
        made[name] = parts.pop(name, 0.0)
    made |= parts
    if last.get("output_s") is not None:
        made["output"] = last["output_s"]
    return made


def _flags(
    runs: Sequence[Record], used: Sequence[Record], contaminated: bool, asked: int, pace: float | None
) -> list[str]:
    """Return the names of the remarks that apply to a job, followed by the disturbances of the runs that count."""
    done = {tuple((r.get("solve") or {}).get(n) for n in ("iterations", "steps")) for r in runs}
    motion = [m for r in runs if (m := (r.get("solve") or {}).get("motion")) is not None]
    found = {
        "contaminated": contaminated,
        "few repeats": len(used) < asked,
        "not warmed up": any(r.get("warmed") is False for r in used),
        "runs differ": len(done) > 1 or (bool(motion) and max(motion) - min(motion) > 1e-9 * max(motion)),
        "differing processors": len({tuple(r.get("cores") or []) for r in used}) > 1,
    }
    found |= {clock: any(r.get("clock") == clock for r in used) for clock in (OWN, WHOLE)}
    causes = [c for c in DISTURBANCES if contaminated and any(c in disturbances(r, pace) for r in used)]
    return [name for name, true in found.items() if true] + causes

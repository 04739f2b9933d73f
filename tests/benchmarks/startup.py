"""CPU time of each command over that of the bare interpreter, against its budget.

    python tests/benchmarks/startup.py [--repeat 7]

Medians of fresh processes, kernels cached. Run it on an installed wheel: an editable install adds about 20 ms.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

BUDGETS = {
    ("--version",): 60,
    ("--help",): 100,
    ("list", "models"): 100,
    ("explain", "fem"): 100,
    ("explain", "E204"): 100,
    ("check", "silicone-beam"): 200,
    ("fmt", "--check", "silicone-beam"): 200,
    ("check", "LONG"): 200,
    ("run", "silicone-beam"): 900,  # again: all of it is taken over
    ("run", "silicone-beam", "--model", "rod", "--json", os.devnull): 1200,
    ("run", "silicone-beam", "--model", "corot_tet", "--json", os.devnull): 1200,
}


def cpu(command: list[str], folder: str) -> float:
    """User and system seconds of a finished child."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def long_scene(folder: str) -> str:
    """A scene of 300 lines."""
    body = "".join(
        f"material m{i} = neo_hookean(young = {i + 1} kPa, poisson = 0.3, density = 1000 kg/m^3)\n"
        f"body b{i} = solid(box(size = (10, 10, {i + 1}) mm), m{i})\n"
        f"support s{i} = fixed(b{i}, where = z <= 0 mm)\n"
        for i in range(100)
    )
    path = Path(folder) / "long.scene"
    path.write_text(body, encoding="utf-8")
    return str(path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--repeat", type=int, default=7)
    repeat = parser.parse_args().repeat
    dsl = str(Path(sys.executable).parent / "dsl")
    with tempfile.TemporaryDirectory() as folder:
        scene = long_scene(folder)
        bare = statistics.median(cpu([sys.executable, "-c", "pass"], folder) for _ in range(repeat))
        print(f"bare interpreter {1000 * bare:.0f} ms; below, CPU ms over it (runs: whole run, not its first step)")
        for command, budget in BUDGETS.items():
            words = [scene if w == "LONG" else w for w in command]
            cpu([dsl, *words], folder)  # caches
            median = 1000 * (statistics.median(cpu([dsl, *words], folder) for _ in range(repeat)) - bare)
            print(f"{median:7.0f}  of {budget:5}  dsl {' '.join(command)}")


if __name__ == "__main__":
    main()

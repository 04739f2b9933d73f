"""Bodies at random squeezed between rigid ones (tests/interpreter/test_squeezed.py), by seeds: what came of each.

Run: .venv/bin/python tests/benchmarks/squeezed.py 0 200
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from softmark import SceneError, loads

sys.path.insert(0, str(Path(__file__).parents[1] / "interpreter"))


def main(first: int, last: int) -> None:
    """A line for each seed: its status, and why there is no answer where there is none."""
    from test_squeezed import squeezed

    for seed in range(first, last):
        begin = time.process_time()
        try:
            found = loads(squeezed(seed)).run().models["fe"]
            known = found.status, found.message or ""
        except SceneError as refused:
            known = "refused", "; ".join(d.message for d in refused.diagnostics)
        print(seed, *known, f"{time.process_time() - begin:.1f} s", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))

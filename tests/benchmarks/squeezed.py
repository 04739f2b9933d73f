"""Bodies at random squeezed between rigid ones (tests/shared/squeezed_bodies.py), by seeds: what came of each.

Run: .venv/bin/python tests/benchmarks/squeezed.py 0 200 [SECONDS]
"""

from __future__ import annotations

import signal
import sys
import time
from pathlib import Path
from types import FrameType

from softmark import SceneError, loads

sys.path.insert(0, str(Path(__file__).parents[1] / "shared"))


class Late(BaseException):
    """It takes more CPU than it is given."""


def _late(number: int, frame: FrameType | None) -> None:
    raise Late


def main(first: int, last: int, most: float = 30.0) -> None:
    """A line for each seed: its status, and why there is no answer where there is none, within so many s of CPU."""
    from squeezed_bodies import squeezed, unlike

    signal.signal(signal.SIGVTALRM, _late)
    for seed in range(first, last):
        begin = time.process_time()
        signal.setitimer(signal.ITIMER_VIRTUAL, most)
        try:
            found = loads(squeezed(seed)).run().models["fe"]
            known = found.status, found.message or unlike(found)
        except SceneError as refused:
            known = "refused", "; ".join(f"{d.code} {d.message}" for d in refused.diagnostics)
        except Late:
            known = "late", ""
        except Exception as broken:
            known = "traceback", repr(broken)
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        print(seed, *known, f"{time.process_time() - begin:.1f} s", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]), *map(float, sys.argv[3:]))

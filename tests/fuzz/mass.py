"""Many scenes, not guided: changed at random, all through `check` in one process, with records of time and memory.

    python tests/fuzz/mass.py [COUNT] [SEED]     100 000 inputs unless said otherwise; needs nothing but softmark

Every input is a scene, a golden or a block of a page after one to six changes of `mutate.py`, or one of
`generate.py`; one in ten is cut or mixed up byte by byte. The same count and seed try the same inputs. Findings go to
$SOFTMARK_FUZZ/mass; exit 1 if there are any.
"""

from __future__ import annotations

import json
import random
import sys
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parent))

import generate
import guard
import mutate
import scene


def inputs(count: int, seed: int) -> Iterator[bytes]:
    """Changed scenes."""
    chance = random.Random(seed)
    every = scene.seeds()
    others = scene.texts(every)
    sound = [text for text in others[:: 1 + 5000 // count] if _is_sound(text)]
    for _ in range(count):
        base = chance.choice(sound if chance.random() < 0.6 else others)
        made = chance.random() < 0.15
        text = generate.scene(chance.choice) if made else mutate.changed(base, chance, others)
        data = text.encode("utf-8", errors="replace")
        yield _mixed(data, chance, every) if chance.random() < 0.1 else data


def _is_sound(text: str) -> bool:
    """Whether a text is a scene without errors, so that a change of it may be one too."""
    return scene.load_scene(scene.Source("seed.scene", text), scene.ERRORS, None)[0] is not None


def _mixed(data: bytes, chance: random.Random, every: list[bytes]) -> bytes:
    """Without regard to letters: cut, a byte changed, two files in one."""
    body = bytearray(data)
    for _ in range(chance.choice([1, 2, 8])):
        at = chance.randint(0, len(body))
        match chance.randrange(4):
            case 0:
                del body[at : at + chance.choice([1, 5, 100_000])]
            case 1:
                body[at:at] = bytes([chance.randrange(256)])
            case 2:
                body[at : at + 1] = bytes([chance.randrange(128)])
            case 3:
                other = chance.choice(every)
                body[at:at] = other[: chance.randint(0, len(other))]
    return bytes(body)


def main() -> int:
    """All inputs, and the figures."""
    count, seed = (int(a) for a in (sys.argv[1:] + ["100000", "1"][len(sys.argv) - 1 :])[:2])
    folder = scene.stage(Path(tempfile.mkdtemp(prefix="softmark-fuzz-")))
    target = scene.target(folder)
    for data in scene.seeds()[:: 1 + 2000 // count]:  # what is imported on first use is, before the fence is closed
        with suppress(Exception):
            target(data)
    watch = guard.Watch("mass", guard.out("mass"), guard.Fence(folder, scene.ROOT))
    for data in inputs(count, seed):
        watch.judge(target, data)
    print(json.dumps(watch.report(), indent=1))
    return int(bool(watch.kept))


if __name__ == "__main__":
    sys.exit(main())

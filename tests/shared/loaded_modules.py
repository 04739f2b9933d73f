"""What a run loads: modules, of which a scene without a word should need none that are about it."""

from __future__ import annotations

import json
import subprocess
import sys


def loaded_by(scene: str) -> set[str]:
    """The modules of softmark that a fresh interpreter holds after it has run a scene, without their `softmark.`."""
    code = f"import json, sys, softmark; softmark.loads({scene!r}).run(); print(json.dumps(sorted(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    modules = json.loads(done.stdout.splitlines()[-1])
    return {name.removeprefix("softmark.") for name in modules if name.startswith("softmark.")}

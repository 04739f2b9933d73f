"""Import of one compiled scipy module without the package that contains it.

`scipy.linalg` takes 0.1 s to import, its BLAS module alone 4 ms.
"""

from __future__ import annotations

import importlib
import sys
from importlib.machinery import PathFinder
from importlib.util import module_from_spec
from pathlib import Path
from types import ModuleType

import scipy


def import_submodule(name: str) -> ModuleType:
    """Return the compiled module with the full `name` scipy.PACKAGE.NAME, imported without its package.

    A later import of the package reuses it. The module must not depend on its package. If its file is elsewhere in
    another version of scipy, it is imported normally, with the package.
    """
    if name in sys.modules:
        return sys.modules[name]
    package = name.split(".")[1:-1]
    spec = PathFinder.find_spec(name, [str(Path(scipy.__file__).parent.joinpath(*package))])
    if spec is None or spec.loader is None:
        return importlib.import_module(name)
    made = module_from_spec(spec)
    sys.modules[name] = made
    try:
        spec.loader.exec_module(made)
    except ImportError:
        del sys.modules[name]
        return importlib.import_module(name)
    return made

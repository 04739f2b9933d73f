"""One compiled module of scipy without the package around it: `scipy.linalg` takes 0.1 s to import, its BLAS 4 ms."""

from __future__ import annotations

import importlib
import sys
from importlib.machinery import PathFinder
from importlib.util import module_from_spec
from pathlib import Path
from types import ModuleType

import scipy


def lone(name: str) -> ModuleType:
    """The module `scipy.PACKAGE.NAME`, which a later import of the package finds and takes.

    It must need nothing of its package; one that lies elsewhere in another scipy is imported the long way.
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

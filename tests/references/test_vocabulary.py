"""What the scene language reads from the references, and what reading it costs."""

from __future__ import annotations

import dataclasses
import inspect
import subprocess
import sys
from typing import Any, get_type_hints

import pytest

from softmark.references import REFERENCES


def test_naming_the_references_imports_no_numerics() -> None:
    # The start-up budget: `list`, `explain` and `check` know every reference without numpy or scipy.
    code = "import sys, softmark.references; print({'numpy', 'scipy'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


@pytest.mark.parametrize("name", REFERENCES)
def test_reference_documents_itself(name: str) -> None:
    reference: Any = REFERENCES[name]
    kinds = ("theory", "measurement", "consensus", "published", "own models", "virtual scan")
    assert reference.usually() in kinds
    assert bool(reference.means) == (reference.usually() in ("theory", "own models"))
    assert len(reference.source.splitlines()) == 1
    ends = (
        "rounding",
        "exactly",
        "stated in the scene",
        "scanned shape, m",
        "in the load",
        "of the displacement, m",
        "coarser solution, m",
        "given force, m",
    )
    assert reference.error_meaning.endswith(ends)
    first, blank, *rest = (inspect.getdoc(reference) or "").splitlines()
    assert first.endswith(".")
    assert not blank
    assert any(line.startswith("Source:") for line in rest)


@pytest.mark.parametrize("name", REFERENCES)
def test_reference_takes_a_body(name: str) -> None:
    hints = get_type_hints(REFERENCES[name], include_extras=True)
    assert "body" in [field.name for field in dataclasses.fields(REFERENCES[name])]
    hint = hints["body"]
    unit, doc = hint.__metadata__
    assert unit == "body"
    assert doc

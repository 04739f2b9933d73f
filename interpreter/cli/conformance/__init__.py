"""Contracts that the class of every word must keep, in plugins and in our own tables; used by `dsl conformance`.

    word_contracts.py    documented, frozen, fields with ranges and meanings, a text that is the same in every process
    metric_contracts.py  finite or a reason, zero error of equal results, repeatable, JSON types
    law_contracts.py     stress and stiffness are derivatives of the energy, zero at rest, invariant under rotation
    trial_scenes.py      a scene for each word is refused or solved, never with an exception or without a number
    plugin_contracts.py  all words of a plugin file

A contract is a generator of breaches: what is wrong and how to fix it. tests/contracts applies them to our own tables.
To add one: a generator here, and a line in `plugin_contracts.py`.
"""

from __future__ import annotations

from softmark.records import dataclass


@dataclass(frozen=True)
class Breach:
    """A broken contract and its remedy; `untried` if it could not be tested."""

    what: str
    remedy: str
    untried: bool = False

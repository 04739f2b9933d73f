"""Contracts that the class of every word of the language must keep, in plugins and in softmark itself.

The command `dsl conformance` tests them:

    word_contracts.py    documented, frozen, fields with ranges and meanings, the same repr in every process
    metric_contracts.py  finite or a reason, zero error of equal results, repeatable, JSON types
    load_contracts.py    half of a load has half of its forces; which planes and axes it is symmetric about
    law_contracts.py     stress and stiffness are derivatives of the energy, zero at rest, invariant under rotation
    trial_scenes.py      a scene with the word is refused or solved, without an exception or a missing number
    plugin_contracts.py  all words of a plugin file

Each contract is a generator function that yields a `Breach` for everything that is wrong. The tests in tests/contracts
apply the contracts to the words of softmark. To add a contract, write a generator here and a line in
`plugin_contracts.py`.
"""

from __future__ import annotations

from softmark.records import dataclass


@dataclass(frozen=True)
class Breach:
    """Breach of a contract and its remedy; `untried` is true if the contract could not be tested."""

    what: str
    remedy: str
    untried: bool = False

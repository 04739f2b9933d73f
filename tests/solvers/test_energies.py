"""What every energy says of itself, over all that there are."""

from __future__ import annotations

import inspect
import pkgutil
from importlib import import_module

import pytest

from softmark.solvers import assembly, energies, model_reduction
from softmark.solvers.energies.elastic_energy import EnergySum
from softmark.solvers.energies.energy import Energy, LaggedTangentEnergy
from softmark.solvers.energies.external_loads import DeadForces
from softmark.solvers.energies.mixed_displacement_pressure import MixedSolid
from softmark.solvers.energies.poroelastic import PoroelasticSolid

METHODS = {"value", "add_gradient", "add_hessian"}
KNOWN = sorted(
    {
        cls
        for package in (assembly, energies, model_reduction)
        for module in pkgutil.iter_modules(package.__path__, f"{package.__name__}.")
        for _, cls in inspect.getmembers(import_module(module.name), inspect.isclass)
        if vars(cls).keys() >= METHODS and cls is not Energy
    },
    key=lambda cls: cls.__qualname__,
)


@pytest.mark.parametrize("cls", KNOWN, ids=lambda cls: cls.__name__)
def test_every_energy_derives_from_energy(cls: type[Energy]) -> None:
    """So that it inherits what most energies are, and nobody has to ask whether it says so."""
    assert Energy in cls.__mro__
    assert isinstance(cls.saddle, bool)
    assert isinstance(cls.integrates_cells, bool)
    if "dNdX" in getattr(cls, "__dataclass_fields__", {}):
        assert cls.integrates_cells
    assert issubclass(cls, LaggedTangentEnergy) == hasattr(cls, "add_both_lagged")


def test_which_energies_are_otherwise() -> None:
    assert {MixedSolid.__name__, PoroelasticSolid.__name__} == {cls.__name__ for cls in KNOWN if cls.saddle}
    assert EnergySum in KNOWN
    assert len(KNOWN) >= 12
    assert not DeadForces.saddle
    assert not DeadForces.integrates_cells

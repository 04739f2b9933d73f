"""Frozen dataclasses of `softmark.records`: they do what the standard library's do, and compile nothing too early."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
from dataclasses import field
from typing import Any, ClassVar

import pytest

from softmark.records import dataclass


@dataclass(frozen=True)
class Point:
    """With every kind of field."""

    x: float
    y: float = 2.0
    names: list[str] = field(default_factory=list)
    seen: int = field(default=0, compare=False, repr=False)
    made: int = field(init=False, default=7)
    kept: list[int] = field(init=False, default_factory=list)
    shift: float = field(default=0.0, kw_only=True)
    COUNT: ClassVar[int] = 3


@dataclasses.dataclass(frozen=True)
class Standard:
    """The same by the standard library."""

    x: float
    y: float = 2.0
    names: list[str] = field(default_factory=list)
    seen: int = field(default=0, compare=False, repr=False)
    made: int = field(init=False, default=7)
    kept: list[int] = field(init=False, default_factory=list)
    shift: float = field(default=0.0, kw_only=True)
    COUNT: ClassVar[int] = 3


@dataclass(frozen=True)
class Pair:
    """Hashable, and checked when it is made."""

    a: int
    b: int = 1

    def __post_init__(self) -> None:
        if self.b < 0:
            raise ValueError("b")


@dataclass(frozen=True)
class Triple(Pair):
    """A frozen class of a frozen class."""

    c: int = 2


@dataclass(frozen=True)
class Empty:
    """No field."""


@dataclasses.dataclass(frozen=True)
class Foreign(Pair):
    """What a user's own file derives."""

    d: int = 3


def test_nothing_is_compiled_before_the_first_object_is_made() -> None:
    @dataclass(frozen=True)
    class Late:
        """Never made until below."""

        a: int

    assert not inspect.isfunction(vars(Late)["__init__"])
    assert Late(1).a == 1
    assert inspect.isfunction(vars(Late)["__init__"])


def test_it_reads_as_the_standard_library_s() -> None:
    ours, theirs = Point(1.0, names=["a"], shift=4.0), Standard(1.0, names=["a"], shift=4.0)
    assert repr(ours) == repr(theirs).replace("Standard", "Point")
    assert dataclasses.asdict(ours) == dataclasses.asdict(theirs)
    assert list(inspect.signature(Point).parameters) == list(inspect.signature(Standard).parameters)
    assert Point.__match_args__ == Standard.__match_args__
    assert [f.name for f in dataclasses.fields(Point)] == [f.name for f in dataclasses.fields(Standard)]
    ours_known, theirs_known = (c.__dataclass_params__ for c in (Point, Standard))  # type: ignore[attr-defined]
    assert repr(ours_known) == repr(theirs_known)


def test_each_object_has_lists_of_its_own() -> None:
    one, other = Point(1.0), Point(1.0)
    assert one.names is not other.names
    assert one.kept is not other.kept
    assert one == other


@pytest.mark.parametrize("thing", [Pair(1), Triple(1, 2, 3), Empty(), Foreign(1)])
def test_equal_objects_are_equal_and_hash_alike(thing: Any) -> None:
    same = copy.deepcopy(thing)
    assert same == thing
    assert hash(same) == hash(thing)
    assert pickle.loads(pickle.dumps(thing)) == thing
    assert dataclasses.replace(thing) == thing
    assert thing != object()


def test_comparison_is_of_one_class() -> None:
    assert Pair(1, 1) != Triple(1, 1)
    assert Point(1.0, seen=1) == Point(1.0, seen=2)
    with pytest.raises(TypeError, match="unhashable"):
        hash(Point(1.0))


def test_a_field_cannot_be_changed() -> None:
    for thing in (Pair(1), Triple(1), Foreign(1)):
        with pytest.raises(dataclasses.FrozenInstanceError, match="cannot assign to field 'a'"):
            thing.a = 2  # type: ignore[misc]
        with pytest.raises(dataclasses.FrozenInstanceError, match="cannot delete field 'a'"):
            del thing.a
    with pytest.raises(dataclasses.FrozenInstanceError):
        Empty().a = 1  # type: ignore[attr-defined]


def test_what_is_missing_or_wrong_is_said_by_name() -> None:
    with pytest.raises(TypeError, match=r"Pair.__init__\(\) missing 1 required positional argument: 'a'"):
        Pair()  # type: ignore[call-arg]
    with pytest.raises(ValueError, match="b"):
        Triple(1, b=-1)
    with pytest.raises(TypeError, match="cannot inherit non-frozen"):

        @dataclasses.dataclass
        class Loose(Pair):  # type: ignore[misc]
            e: int = 0


def test_a_class_with_methods_of_its_own_keeps_them() -> None:
    @dataclass(frozen=True)
    class Named:
        """Says itself otherwise."""

        a: int

        def __repr__(self) -> str:
            return "named"

    assert repr(Named(1)) == "named"
    assert Named(1) == Named(1)

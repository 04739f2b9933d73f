"""Frozen dataclasses that take a twentieth of the import time of the standard library's.

`dataclasses.dataclass(frozen=True)` compiles six methods for every class, used or not: 0.5 ms for each class, and the
vocabulary has hundreds of classes. Here the methods are closures, and `__init__` is compiled when the first object of
the class is made. The classes behave like those of the standard library, with `fields`, `replace`, `asdict`,
`__match_args__`, inheritance in both directions, and a class's own `__repr__`. Classes with other options (slots,
order, not frozen, own methods under these names) are made by the standard library.
"""

from __future__ import annotations

import dataclasses
from operator import attrgetter
from reprlib import recursive_repr

TYPE_CHECKING = False  # as in `typing`, which takes longer to import than this
if TYPE_CHECKING:
    from collections.abc import Callable
    from dataclasses import dataclass as dataclass
    from typing import Any
else:

    def dataclass(cls=None, /, **options):
        """Make a class a dataclass, with the options and errors of `dataclasses.dataclass`."""
        if cls is not None:
            return dataclasses.dataclass(cls, **options)
        if options != {"frozen": True}:
            return dataclasses.dataclass(**options)
        return _make_frozen_dataclass


_OWN = {"__init__", "__eq__", "__hash__", "__setattr__", "__delattr__", "__slots__"}
_GIVEN = object()  # placeholder for a value that a factory makes


def _make_frozen_dataclass(cls: type[Any]) -> type[Any]:
    """Make a class a frozen dataclass. Raises TypeError in the same cases as the standard library."""
    if _OWN & vars(cls).keys() or not cls.__doc__:
        return dataclasses.dataclass(frozen=True)(cls)
    derived = any(hasattr(base, "__dataclass_params__") for base in cls.__mro__[1:])
    # the standard library allows only frozen bases here
    dataclasses.dataclass(init=False, repr=False, eq=False, frozen=derived)(cls)
    told: Any = cls
    told.__init__ = _Init(cls)
    if "__repr__" not in vars(cls):
        told.__repr__ = _repr(cls)
    told.__eq__, told.__hash__ = _comparison_methods(cls)
    if not derived:
        told.__setattr__, told.__delattr__ = _immutability_methods(cls)
    known = told.__dataclass_params__
    known.init = known.repr = known.eq = known.frozen = True
    return cls


class _Init:
    """Descriptor that compiles the `__init__` of a class on first use."""

    def __init__(self, cls: type[Any]) -> None:
        self.cls = cls

    def __get__(self, thing: object, owner: type[Any] | None = None) -> Any:
        made: Any = _init(self.cls)
        setattr(self.cls, "__init__", made)  # noqa: B010  (mypy forbids the assignment)
        return made if thing is None else made.__get__(thing, owner)


def _init(cls: type[Any]) -> Callable[..., None]:
    """Return an `__init__` that sets each field of the class and then calls `__post_init__`, if there is one."""
    fields = dataclasses.fields(cls)
    known: dict[str, Any] = {"_set": object.__setattr__, "_given": _GIVEN}
    known |= {f"_make_{f.name}": f.default_factory for f in fields}
    known |= {f"_default_{f.name}": f.default for f in fields}
    asked = [f for f in fields if f.init]
    plain, named = ([_parameter(f) for f in asked if f.kw_only is k] for k in (False, True))
    lines = [line for f in fields if (line := _assignment_source(f))]
    if hasattr(cls, "__post_init__"):
        lines.append("self.__post_init__()")
    head = ", ".join(["self", *plain, *(["*", *named] if named else [])])
    exec(f"def __init__({head}):\n " + "\n ".join(lines or ["pass"]), known)
    made: Any = known["__init__"]
    made.__qualname__, made.__module__ = f"{cls.__qualname__}.__init__", cls.__module__
    made.__annotations__ = {f.name: f.type for f in asked} | {"return": None}
    return made  # type: ignore[no-any-return]


def _parameter(f: dataclasses.Field[Any]) -> str:
    """Return the parameter of a field in the signature of `__init__`, as source text."""
    if f.default_factory is not dataclasses.MISSING:
        return f"{f.name}=_given"
    return f.name if f.default is dataclasses.MISSING else f"{f.name}=_default_{f.name}"


def _assignment_source(f: dataclasses.Field[Any]) -> str:
    """Return the source line that sets a field, or "" if the class attribute already has its value."""
    if f.default_factory is not dataclasses.MISSING:
        value = f"_make_{f.name}() if {f.name} is _given else {f.name}" if f.init else f"_make_{f.name}()"
    elif f.init:
        value = f.name
    else:
        return ""
    return f"_set(self, {f.name!r}, {value})"


def _attribute_reader(names: list[str]) -> Callable[[Any], tuple[Any, ...]]:
    """Return a function that reads the attributes `names` of an object as a tuple."""
    if len(names) > 1:
        return attrgetter(*names)
    return lambda thing: tuple(getattr(thing, n) for n in names)


def _comparison_methods(cls: Any) -> tuple[Callable[[Any, Any], bool], Callable[[Any], int]]:
    """Return the methods `__eq__` and `__hash__` for a class."""
    fields = dataclasses.fields(cls)
    compared = _attribute_reader([f.name for f in fields if f.compare])
    hashed = _attribute_reader([f.name for f in fields if (f.compare if f.hash is None else f.hash)])

    def __eq__(self: Any, other: object) -> bool:  # noqa: N807
        return compared(self) == compared(other) if other.__class__ is self.__class__ else NotImplemented

    def __hash__(self: Any) -> int:  # noqa: N807
        return hash(hashed(self))

    return __eq__, __hash__


def _repr(cls: Any) -> Callable[[Any], str]:
    """Return the method `__repr__` for a class."""
    names = [f.name for f in dataclasses.fields(cls) if f.repr]

    @recursive_repr()
    def __repr__(self: Any) -> str:  # noqa: N807
        return f"{type(self).__qualname__}({', '.join(f'{n}={getattr(self, n)!r}' for n in names)})"

    return __repr__


def _immutability_methods(cls: Any) -> tuple[Callable[[Any, str, Any], None], Callable[[Any, str], None]]:
    """Return methods `__setattr__` and `__delattr__` that refuse changes of fields, also in subclasses."""
    names = {f.name for f in dataclasses.fields(cls)}

    def __setattr__(self: Any, name: str, value: Any) -> None:  # noqa: N807
        if type(self) is cls or name in names:
            raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")
        super(cls, self).__setattr__(name, value)

    def __delattr__(self: Any, name: str) -> None:  # noqa: N807
        if type(self) is cls or name in names:
            raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")
        super(cls, self).__delattr__(name)

    return __setattr__, __delattr__

"""Which name is meant by a misspelt one."""

from __future__ import annotations

import pytest

from softmark.grammar.name_suggestions import distance, nearest

NAMES = [
    "young",
    "poisson",
    "density",
    "length",
    "radius",
    "axis",
    "neo_hookean",
    "linear_elastic",
    "h",
    "nu",
    "mu",
    "eta",
]


@pytest.mark.parametrize(
    ("word", "expected"),
    [
        ("yonug", "young"),
        ("Young", "young"),
        ("YOUNG", "young"),
        ("poison", "poisson"),
        ("lenght", "length"),
        ("axs", "axis"),
        ("neohookean", "neo_hookean"),
        ("lin_elastic", "linear_elastic"),
        ("H", "h"),
        ("Nu", "nu"),
        ("ru", None),
        ("x", None),
        ("", None),
        ("temperature", None),
        ("radial", "radius"),
        ("eat", "eta"),
    ],
)
def test_the_nearest_name(word: str, expected: str | None) -> None:
    assert nearest(word, NAMES) == expected


def test_of_equals_the_one_with_the_same_beginning_wins() -> None:
    assert nearest("beem", ["seem", "beam"]) == "beam"
    assert nearest("beem", ["team", "ream"]) is None
    assert nearest("tip1", ["tip3", "tip2"]) == "tip2"
    assert nearest("tip1", []) is None


@pytest.mark.parametrize(
    ("a", "b", "expected"),
    [("", "", 0), ("", "abc", 3), ("abc", "", 3), ("abc", "abc", 0), ("abcd", "abdc", 1), ("ab", "ba", 1),
     ("kitten", "sitting", 3), ("ca", "abc", 3)],
)  # fmt: skip
def test_distances_counted_by_hand(a: str, b: str, expected: int) -> None:
    """`ca` to `abc` is 3, not 2: no letters are put between two that were swapped."""
    assert distance(a, b) == distance(b, a) == expected

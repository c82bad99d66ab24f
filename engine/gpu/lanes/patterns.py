"""How a value varies over the lanes."""
from __future__ import annotations

from enum import IntEnum
from typing import Union


class Pattern(IntEnum):
    """How a scalar varies over the lanes. u is the same for all lanes, v a multiple of the width."""

    UNIFORM = 0  # u
    ALIGNED = 1  # v + lane
    CONSECUTIVE = 2  # u + lane
    VARYING = 3  # anything
    # The two halves of an index v + lane into vectors of four, which address words in a row.
    QUARTER = 4  # u + (v + lane) / 4
    COMPONENT = 5  # (v + lane) % 4
    # With 16 lanes, where each half of the lanes has a value h of its own.
    HALVES = 6  # h
    EIGHTS = 7  # h + lane % 8


UNIFORM, ALIGNED, CONSECUTIVE, VARYING = Pattern.UNIFORM, Pattern.ALIGNED, Pattern.CONSECUTIVE, Pattern.VARYING
QUARTER, COMPONENT, HALVES, EIGHTS = Pattern.QUARTER, Pattern.COMPONENT, Pattern.HALVES, Pattern.EIGHTS

# The pattern of a value: a list with an entry for each part of a vector or struct, and one entry for all parts of an
# array or matrix.
Patterns = Union[Pattern, list["Patterns"]]


def leaves(p: Patterns) -> list[Pattern]:
    return [p] if isinstance(p, Pattern) else [leaf for part in p for leaf in leaves(part)]


def components(p: Patterns) -> list[Patterns]:
    """The patterns of the parts of a composite."""
    assert isinstance(p, list)
    return p


def join(a: Patterns, b: Patterns) -> Patterns:
    """The pattern of a value that is one of two."""
    if isinstance(a, Pattern) or isinstance(b, Pattern):
        return a if a == b else VARYING
    return [join(x, y) for x, y in zip(a, b)]


def is_uniform(p: Patterns) -> bool:
    return all(leaf == UNIFORM for leaf in leaves(p))

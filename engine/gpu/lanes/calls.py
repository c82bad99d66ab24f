"""The calls of a kernel's functions, and the values in them."""
from __future__ import annotations

import itertools
from typing import NamedTuple

from spirv import NO_ID, Function


class Key(NamedTuple):
    """A value: a SPIR-V id as seen by one call of the function that defines it. Call 0: constants and globals."""

    id: int
    call: int

    @staticmethod
    def of_result(call: int) -> Key:
        """The value that a call returns."""
        return Key(NO_ID, call)

    @property
    def is_result(self) -> bool:
        return self.id == NO_ID


class Call:
    """One call of a function. Ids that the function defines get the number of the call."""

    _numbers = itertools.count(1)

    def __init__(self, function: Function, arguments: list[Key]) -> None:
        self.function = function
        self.number = next(Call._numbers)
        self.own: dict[int, Key] = {param.id: key for param, key in zip(function.params, arguments)}

    def key(self, id_: int) -> Key:
        """The value of an id in this call."""
        if id_ not in self.own:
            if id_ not in self.function.ids:
                return Key(id_, 0)
            self.own[id_] = Key(id_, self.number)
        return self.own[id_]

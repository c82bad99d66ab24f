"""The tree of a kernel: instructions, branches, loops, and calls with the body of the callee in their place."""
from __future__ import annotations

import itertools
from typing import Callable, Iterator, NamedTuple, Union

from calls import Call, Key
from spirv import Instruction


class Exit(NamedTuple):
    """A way out: of a loop ("break", "continue") by its number, or of a call ("return") by its number."""

    kind: str
    number: int


class Step(NamedTuple):
    """One step from the root of the tree to a node: into a part ("then", "other", "rest", "loop", "call") of `node`."""

    node: Node
    part: str


Path = tuple[Step, ...]


class Node:
    """A node of the tree. `child_lists` names the attributes that are lists of nodes."""

    child_lists: tuple[str, ...] = ()

    def children(self) -> Iterator[list[Node]]:
        return (getattr(self, name) for name in self.child_lists)

    def replace_children(self, change: Callable[[list[Node]], list[Node]]) -> None:
        for name in self.child_lists:
            setattr(self, name, change(getattr(self, name)))


class InstructionNode(Node):
    """An instruction without control flow. `key` is its result, if any; `args` are the operands that are values."""

    def __init__(self, inst: Instruction, caller: Call) -> None:
        self.inst, self.caller = inst, caller
        self.path: Path = ()
        self.key: Key | None = None
        self.args: list[Key | None] = []

    def operand(self, i: int) -> Key:
        """An operand that is a value."""
        key = self.args[i]
        assert key is not None
        return key

    def result(self) -> Key:
        assert self.key is not None
        return self.key


class PhiNode(Node):
    """Gives `key` the value it has if control comes from here."""

    def __init__(self, key: Key, type_: int, value: Key) -> None:
        self.key, self.type, self.value = key, type_, value
        self.path: Path = ()


class IfNode(Node):
    child_lists = ("then", "other")

    def __init__(self, condition: Key, then: list[Node], other: list[Node]) -> None:
        self.condition, self.then, self.other = condition, then, other


class RestNode(Node):
    """The nodes after a node that some lanes may leave through `exits`: they run under a mask of the lanes left."""

    child_lists = ("body",)

    def __init__(self, body: list[Node], exits: set[Exit]) -> None:
        self.body, self.exits = body, exits


class LoopNode(Node):
    """A loop: `body` up to the continue target, `tail` from there back to the head."""

    child_lists = ("body", "tail")
    _numbers = itertools.count(1)

    def __init__(self, merge: int, continue_target: int, unroll: bool) -> None:
        self.merge, self.continue_target, self.unroll = merge, continue_target, unroll
        self.number = next(LoopNode._numbers)
        self.break_ = Exit("break", self.number)
        self.continue_ = Exit("continue", self.number)
        self.body: list[Node] = []
        self.tail: list[Node] = []
        self.exits: set[Exit] = set()  # also those that leave enclosing loops or calls
        self.label = ""


class CallNode(Node):
    """A call with the body of the callee. `result` is the value it returns, if any."""

    child_lists = ("body",)

    def __init__(self, body: list[Node], number: int, result: Key | None) -> None:
        self.body, self.number, self.result = body, number, result
        self.return_ = Exit("return", number)


class LeaveNode(Node):
    """A break or continue of `loop`."""

    def __init__(self, kind: str, loop: LoopNode) -> None:
        self.kind, self.loop = kind, loop
        self.exit = Exit(kind, loop.number)


class ReturnNode(Node):
    """A return from a call, with a value for `result` if it has one."""

    def __init__(self, call: int, value: Key | None = None, result: Key | None = None) -> None:
        self.call, self.value, self.result = call, value, result
        self.exit = Exit("return", call)
        self.path: Path = ()


# Nodes that load or store a variable: Load and Store instructions, phis and returns.
AccessNode = Union[InstructionNode, PhiNode, ReturnNode]


def exits_in(nodes: list[Node]) -> set[Exit]:
    """Ways out of a list of nodes: of loops and calls that enclose it."""
    exits: set[Exit] = set()
    for n in nodes:
        if isinstance(n, (LeaveNode, ReturnNode)):
            exits.add(n.exit)
            continue
        inner: set[Exit] = set()
        for children in n.children():
            inner |= exits_in(children)
        if isinstance(n, LoopNode):
            inner -= {n.break_, n.continue_}
        elif isinstance(n, CallNode):
            inner.discard(n.return_)
        exits |= inner
    return exits


def nest_rests(nodes: list[Node]) -> list[Node]:
    """Puts the nodes that follow a node which some lanes may leave into a node of their own."""
    nested: list[Node] = []
    for at, n in enumerate(nodes):
        n.replace_children(nest_rests)
        nested.append(n)
        if isinstance(n, (IfNode, LoopNode)) and at + 1 < len(nodes):
            exits = exits_in([n])
            if exits:
                nested.append(RestNode(nest_rests(nodes[at + 1:]), exits))
                return nested
    return nested

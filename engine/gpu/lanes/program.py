"""A kernel as one tree of all its calls, and where it accesses its variables."""
from __future__ import annotations

from typing import NamedTuple

from calls import Key
from nodes import (AccessNode, CallNode, Exit, IfNode, InstructionNode, LeaveNode, LoopNode, Node, Path, PhiNode,
                   RestNode, ReturnNode, Step, exits_in, nest_rests)
from spirv import NO_ID, Instruction, Module
from spirv_names import ACCESS_CHAINS, Op, StorageClass
from structure import Structurer


class Access(NamedTuple):
    """A load or store of a variable, with its place in the tree and in the order of execution."""

    is_store: bool
    order: int
    path: Path
    node: AccessNode


class Pointer(NamedTuple):
    """A pointer: the variable or loaded address that it starts from, the type that points to, and indices into it."""

    storage: StorageClass
    root: Key
    indices: list[Key]
    type: int


# Operands that are values, as a range; all operands of other instructions are.
VALUE_OPERANDS: dict[Op, range] = {
    Op.CompositeExtract: range(1),
    Op.CompositeInsert: range(2),
    Op.VectorShuffle: range(2),
    Op.ExtInst: range(2, 99),
    Op.Load: range(1),
    Op.Store: range(2),
    Op.ControlBarrier: range(0),
    Op.MemoryBarrier: range(0),
}
ALL_OPERANDS = range(99)


class Program:
    """One kernel. `types` holds the type of each value, `instructions` all instructions in order of execution."""

    def __init__(self, module: Module, width: int) -> None:
        self.module, self.width = module, width
        self.types: dict[Key, int] = {}
        self.chains: dict[Key, tuple[Key, list[Key]]] = {}  # access chains: base and indices
        self.instructions: list[InstructionNode] = []
        self.accesses: dict[Key, list[Access]] = {}  # of variables, phis and results of calls
        self.exit_sites: dict[Exit, list[Path]] = {}
        self.loops: list[LoopNode] = []
        self._pointers: dict[Key, Pointer] = {}
        self._order = 0
        self.tree: CallNode = Structurer(module, module.functions[module.entry], [], self.types).tree()
        self.tree.body = nest_rests(self.tree.body)
        self._walk([self.tree], ())

    # Types.

    def type(self, id_: int) -> Instruction:
        return self.module.ids[id_]

    def part_type(self, type_: int, index: int) -> int:
        """Type of a part of a composite. The index matters for structs only."""
        t = self.type(type_)
        return t.args[index] if t.op == Op.TypeStruct else t.args[0]

    def type_of(self, key: Key) -> int:
        return self.types[key] if key in self.types else self.module.ids[key.id].type

    # Pointers.

    def pointer(self, key: Key) -> Pointer:
        if key not in self._pointers:
            self._pointers[key] = self._pointer(key)
        return self._pointers[key]

    def _pointer(self, key: Key) -> Pointer:
        if key in self.chains:
            base_key, indices = self.chains[key]
            base = self.pointer(base_key)
            return base._replace(indices=base.indices + indices)
        inst = self.module.ids[key.id]
        if inst.op == Op.Variable:
            storage, type_ = self.type(inst.type).args[:2]
            return Pointer(StorageClass(storage), key, [], type_)
        type_ = self.type(self.types.get(key, inst.type)).args[1]
        return Pointer(StorageClass.PhysicalStorageBuffer, key, [], type_)  # a loaded address

    # The walk that finds accesses.

    def _walk(self, nodes: list[Node], path: Path) -> None:
        for n in nodes:
            if isinstance(n, InstructionNode):
                self._order += 1
                self._add_instruction(n, path)
            elif isinstance(n, PhiNode):
                self.types.setdefault(n.key, n.type)
                self._add_store(n.key, n, path)
            elif isinstance(n, IfNode):
                self._walk(n.then, path + (Step(n, "then"),))
                self._walk(n.other, path + (Step(n, "other"),))
            elif isinstance(n, RestNode):
                self._walk(n.body, path + (Step(n, "rest"),))
            elif isinstance(n, LoopNode):
                self.loops.append(n)
                self._walk(n.body, path + (Step(n, "loop"),))
                self._walk(n.tail, path + (Step(n, "loop"),))
                n.exits = exits_in([n]) | {n.break_, n.continue_}
            elif isinstance(n, CallNode):
                self._walk(n.body, path + (Step(n, "call"),))
            elif isinstance(n, LeaveNode):
                self.exit_sites.setdefault(n.exit, []).append(path)
            elif isinstance(n, ReturnNode):
                self.exit_sites.setdefault(n.exit, []).append(path)
                if n.result is not None:
                    self._add_store(n.result, n, path)

    def _add_store(self, key: Key, n: PhiNode | ReturnNode, path: Path) -> None:
        self._order += 1
        n.path = path
        self.accesses.setdefault(key, []).append(Access(True, self._order, path, n))

    def _add_instruction(self, n: InstructionNode, path: Path) -> None:
        inst, key_of = n.inst, n.caller.key
        n.path = path
        if inst.id != NO_ID:
            n.key = key_of(inst.id)
            self.types[n.key] = inst.type
        if inst.op == Op.Variable:
            self.types[n.result()] = self.type(inst.type).args[1]
            self.accesses.setdefault(n.result(), [])
            return
        if inst.op in ACCESS_CHAINS:
            self.chains[n.result()] = (key_of(inst.args[0]), [key_of(a) for a in inst.args[1:]])
            return
        values = VALUE_OPERANDS.get(inst.op, ALL_OPERANDS)
        n.args = [key_of(a) if i in values else None for i, a in enumerate(inst.args)]
        if inst.op in (Op.Load, Op.Store):
            pointer = self.pointer(n.operand(0))
            if pointer.storage == StorageClass.Function:
                access = Access(inst.op == Op.Store, self._order, path, n)
                self.accesses.setdefault(pointer.root, []).append(access)
        self.instructions.append(n)

"""Writes a kernel as C++ with the functions of lanes.h and lane_memory.h."""
from __future__ import annotations

from typing import NamedTuple

from calls import Key
from expressions import fold
from nodes import InstructionNode, PhiNode, ReturnNode
from parts import Leaf, Tree
from spirv import fail
from spirv_names import ACCESS_CHAINS, ATOMICS, QUOTIENTS, REMAINDERS, BuiltIn, Decoration, Op, StorageClass
from write_control import ControlWriter
from write_locals import LocalsWriter
from write_memory import MemoryWriter


class WrittenKernel(NamedTuple):
    text: str
    has_barriers: bool


class Writer(MemoryWriter, LocalsWriter, ControlWriter):
    """Writes the C++ of one program. `name` is its namespace."""

    def write(self) -> WrittenKernel:
        self.find_indexed()
        self._find_used()
        self.inline(self.program.tree, None)
        shared = "\n".join(self._shared_variables())
        body = "\n".join(self.lines)
        text = (f"namespace {self.name} {{\n"
                f"namespace {{\n{shared}\n}}\n"
                "void run([[maybe_unused]] const std::byte* arguments) {\n"
                "  [[maybe_unused]] const vu lane = lanes_from(invocation.thread);\n"
                "  [[maybe_unused]] const std::uint32_t group = invocation.group;\n"
                f"{body}\n"
                "}\n"
                "}\n")
        has_barriers = any(n.inst.op == Op.ControlBarrier for n in self.program.instructions)
        return WrittenKernel(text, has_barriers and self._needs_barriers())

    def _needs_barriers(self) -> bool:
        """Whether a workgroup has more invocations than lanes."""
        return self.program.width < self.module.local_size

    def _find_used(self) -> None:
        for n in self.program.instructions:
            self.used |= set(n.args)
        for accesses in self.program.accesses.values():
            self.used |= {a.node.value for a in accesses if isinstance(a.node, (PhiNode, ReturnNode))}

    def _shared_variables(self) -> list[str]:
        declarations = []
        for variable in self.module.globals:
            storage, type_ = self.module.ids[variable.type].args[:2]
            if storage == StorageClass.Workgroup:
                array = f"shared_{variable.id}[{self.types.words(type_)}]"
                declarations.append(f"[[maybe_unused]] alignas(64) thread_local std::uint32_t {array};")
        return declarations

    # Instructions.

    def instruction(self, n: InstructionNode, mask: str | None) -> None:
        op = n.inst.op
        if op in ACCESS_CHAINS or op == Op.MemoryBarrier:
            return
        if op == Op.ControlBarrier:
            if self._needs_barriers():
                self.out("barrier();")
        elif op == Op.Store:
            self._store(n, mask)
        elif op in ATOMICS:
            self.atomic(n, mask)
        else:
            self._value(n, n.result(), mask)

    def _store(self, n: InstructionNode, mask: str | None) -> None:
        if self.program.pointer(n.operand(0)).storage == StorageClass.Function:
            self.store_local(n, mask)
        else:
            self.store_memory(n.operand(1), n.operand(0), mask)

    def _value(self, n: InstructionNode, key: Key, mask: str | None) -> None:
        """An instruction with a result, `key`."""
        op = n.inst.op
        if op == Op.Variable:
            self.declare(key, self.program.types[key])
        elif op == Op.Undef:
            self.trees[key] = self.types.zeros(n.inst.type)
        elif op == Op.Load:
            self._load(n, key, mask)
        else:
            tree = self._rearranged(n)
            if tree is not None:
                self.trees[key] = tree
            else:
                self._operation(n, key)

    def _load(self, n: InstructionNode, key: Key, mask: str | None) -> None:
        pointer = self.program.pointer(n.operand(0))
        if pointer.storage == StorageClass.Function:
            self.load_local(n)
        elif pointer.storage == StorageClass.Input:
            self.trees[key] = self._builtin(pointer.root, pointer.indices)
        else:
            self.load_memory(key, n.operand(0), mask)

    def _builtin(self, variable: Key, indices: list[Key]) -> Leaf:
        number = self.module.decorations[variable.id][Decoration.BuiltIn][0]
        if number == BuiltIn.LocalInvocationIndex:
            return Leaf("lane", True)
        component = self.module.constant(indices[0].id) if indices else None
        if component is None or number not in (BuiltIn.NumWorkgroups, BuiltIn.WorkgroupId):
            fail(f"{self.module.path}: builtin {number} is not supported, or only its components are")
        if number == BuiltIn.NumWorkgroups:
            return Leaf("1u", False)
        return Leaf("group" if component == 0 else "0u", False)

    def _rearranged(self, n: InstructionNode) -> Tree | None:
        """The tree of an instruction that only rearranges scalars and needs no code; None for others."""
        inst = n.inst
        trees = [self.tree(a) for a in n.args if a is not None]
        if inst.op == Op.CompositeConstruct:
            if self.types.of(inst.type).op != Op.TypeVector:
                return trees
            return [scalar for tree in trees for scalar in (tree if isinstance(tree, list) else [tree])]
        if inst.op == Op.CompositeExtract:
            tree = trees[0]
            for index in inst.args[1:]:
                assert isinstance(tree, list)
                tree = tree[index]
            return tree
        if inst.op == Op.VectorShuffle:
            both = [scalar for tree in trees for scalar in tree]
            return [both[i] for i in inst.args[2:]]
        return trees[0] if inst.op in (Op.CopyObject, Op.CopyLogical) else None

    def _operation(self, n: InstructionNode, key: Key) -> None:
        inst = n.inst
        t, is_scalar = self.types.of(inst.type), self.types.is_scalar(inst.type)
        if t.op in (Op.TypeInt, Op.TypeBool):
            is_unsigned = t.op == Op.TypeInt and not t.args[1]
            value = fold(inst.op, [None if a is None else self.number(a) for a in n.args], is_unsigned)
            if value is not None:
                self.known[key] = value
                self.trees[key] = self.types.number(inst.type, value)
                return
        wanted = self.wanted(inst.type, self.pattern(key))
        args = [None if a is None else self.tree(a) for a in n.args]
        is_divisor_uniform = False
        if is_scalar and (inst.op in QUOTIENTS or inst.op in REMAINDERS):
            is_divisor_uniform = not self.differs(n.operand(1))
        self.define(key, inst.type, self.expressions.of(inst, args, wanted, is_divisor_uniform), wanted)

"""The C++ of loads, stores and atomics in memory: addresses, and whether lanes access consecutive words."""
from __future__ import annotations

from math import gcd
from typing import Any, Callable, NamedTuple

from calls import Key
from nodes import InstructionNode
from parts import Leaf, Texts, Tree, first, vary
from patterns import ALIGNED, COMPONENT, CONSECUTIVE, EIGHTS, QUARTER, VARYING, Patterns
from spirv import fail
from spirv_names import Decoration, Op, StorageClass
from writer_base import WriterBase

# Operations on words that can be computed for the first lane alone. A remainder only if the divisor is a number other
# than zero.
IN_FIRST_LANE = {
    Op.IAdd: "+", Op.ISub: "-", Op.IMul: "*", Op.UMod: "%", Op.ShiftRightLogical: ">>", Op.BitwiseAnd: "&"}
FIRST_LANE_DEPTH = 6  # operations
ATOMIC_FUNCTIONS = {
    Op.AtomicIAdd: "atomic_add", Op.AtomicUMax: "atomic_max", Op.AtomicOr: "atomic_or",
    Op.AtomicCompareExchange: "atomic_exchange_if"}
DEFAULT_MATRIX_STRIDE = 16  # bytes


class Term(NamedTuple):
    """An index in which lanes differ, and the bytes from one element to the next."""

    index: Key
    stride: int
    pattern: Patterns


class Address(NamedTuple):
    """An address: an expression that is the same for all lanes, plus terms in which lanes differ."""

    base: str
    terms: list[Term]
    type: int
    is_shared: bool


class LaneIndex(NamedTuple):
    """The sum of the terms of an address: indices with factors, in units of `stride` bytes."""

    terms: list[tuple[Key, int]]
    stride: int
    pattern: Patterns


def filled(tree: Any, value: Any) -> Any:
    """A tree of the same shape, with one value everywhere."""
    return [filled(part, value) for part in tree] if isinstance(tree, list) else value


class MemoryWriter(WriterBase):
    """Part of Writer (write_cpp.py)."""

    # Stride of the matrices in the struct member that was looked at last. SPIR-V states it there, not with the matrix.
    _matrix_stride = DEFAULT_MATRIX_STRIDE

    # Addresses.

    def _address(self, key: Key) -> Address:
        pointer = self.program.pointer(key)
        has_layout = pointer.storage != StorageClass.Workgroup
        offset, type_ = 0, pointer.type
        terms: list[Term] = []
        summands = [self._base(pointer.storage, pointer.root)]
        for index in pointer.indices:
            t = self.types.of(type_)
            known = self.number(index)
            if t.op == Op.TypeStruct:
                assert known is not None
                offset += self._member_offset(type_, known, has_layout)
                type_ = t.args[known]
                continue
            stride = self._stride(type_, has_layout)
            type_ = t.args[0]
            if known is not None:
                offset += known * stride
            elif self.differs(index):
                terms.append(Term(index, stride, self.pattern(index)))
            else:
                summands.append(f"std::size_t({first(self.leaf(index))}) * {stride}")
        if offset:
            summands.append(str(offset))
        return Address(" + ".join(summands), terms, type_, not has_layout)

    def _base(self, storage: StorageClass, root: Key) -> str:
        if storage == StorageClass.PushConstant:
            return "const_cast<char*>(reinterpret_cast<const char*>(arguments))"
        if storage == StorageClass.PhysicalStorageBuffer:
            leaf = self.leaf(root)
            if leaf.varying:
                fail(f"{self.module.path}: an address differs between lanes")
            return leaf.text
        return f"reinterpret_cast<char*>(shared_{root.id})"

    def _member_offset(self, struct: int, member: int, has_layout: bool) -> int:
        self._matrix_stride = self.module.matrix_strides.get((struct, member), DEFAULT_MATRIX_STRIDE)
        if has_layout:
            return self.module.member_offsets[struct, member]
        return 4 * sum(map(self.types.words, self.types.of(struct).args[:member]))

    def _stride(self, type_: int, has_layout: bool) -> int:
        """Bytes from one part of an array, matrix or vector to the next."""
        t = self.types.of(type_)
        if not has_layout:
            return 4 * self.types.words(t.args[0])
        if t.op in (Op.TypeArray, Op.TypeRuntimeArray):
            return self.module.decorations[type_][Decoration.ArrayStride][0]
        return self._matrix_stride if t.op == Op.TypeMatrix else 4

    @staticmethod
    def _lane_index(terms: list[Term]) -> LaneIndex:
        if len(terms) == 1:
            return LaneIndex([(terms[0].index, 1)], terms[0].stride, terms[0].pattern)
        stride = gcd(*(term.stride for term in terms))
        by_stride = sorted((term.stride, term.pattern) for term in terms)
        is_consecutive = by_stride == [(4, COMPONENT), (16, QUARTER)]
        return LaneIndex([(term.index, term.stride // stride) for term in terms], stride,
                         CONSECUTIVE if is_consecutive else VARYING)

    def _index_of_lanes(self, index: LaneIndex) -> str:
        return self._sum(index, lambda key: f"as_u({self.leaf(key).text})")

    def _index_of_first(self, index: LaneIndex) -> str:
        """The index of the first lane as a scalar."""
        return self._sum(index, lambda key: self._first_lane(key, FIRST_LANE_DEPTH))

    @staticmethod
    def _sum(index: LaneIndex, text: Callable[[Key], str]) -> str:
        return " + ".join(text(key) + (f" * {factor}u" if factor != 1 else "") for key, factor in index.terms)

    def _first_lane(self, key: Key, depth: int) -> str:
        """An integer in the first lane, computed from scalars as far as possible: lanes that access consecutive words
        need only that."""
        if not self.differs(key):
            return f"std::uint32_t({first(self.leaf(key))})"
        maker = self.makers.get(key)
        sign = IN_FIRST_LANE.get(maker.inst.op) if maker is not None else None
        if maker is not None and sign is not None and depth > 0:
            left, right = maker.operand(0), maker.operand(1)
            if sign != "%" or self.number(right):
                return f"({self._first_lane(left, depth - 1)} {sign} {self._first_lane(right, depth - 1)})"
        return f"as_u({self.leaf(key).text})[0]"

    def _offsets(self, type_: int, has_layout: bool, offset: int = 0) -> Any:
        """Tree of the offsets of a type's scalars in memory."""
        t = self.types.of(type_)
        if self.types.is_scalar(type_):
            return offset
        if t.op == Op.TypeStruct:
            found = []
            for i, part in enumerate(t.args):
                at = self._member_offset(type_, i, has_layout)
                found.append(self._offsets(part, has_layout, offset + at))
            return found
        if t.op == Op.TypeVector:
            return [offset + 4 * i for i in range(t.args[1])]
        stride = self._stride(type_, has_layout)
        return [self._offsets(t.args[0], has_layout, offset + i * stride) for i in range(len(self.types.parts(type_)))]

    def _is_vector_of_four(self, type_: int) -> bool:
        t = self.types.of(type_)
        return t.op == Op.TypeVector and t.args[1] == 4

    def _write_base(self, address: Address) -> str:
        base = self.fresh("p")
        self.out(f"char* const {base} = {address.base};")
        return base

    def _write_run(self, base: str, index: LaneIndex) -> str:
        """A pointer to the word of the first lane, from which lanes access consecutive words."""
        at = self.fresh("i")
        offset = f"std::ptrdiff_t(std::int32_t({self._index_of_first(index)})) * {index.stride}"
        self.out(f"char* const {at} = {base} + {offset};")
        return at

    # Loads.

    def load_memory(self, key: Key, pointer: Key, mask: str | None) -> None:
        address = self._address(pointer)
        base = self._write_base(address)
        offsets = self._offsets(address.type, not address.is_shared)
        if not address.terms:
            texts = self._texts(address.type, offsets, base)
            self.define(key, address.type, texts, filled(offsets, False))
            return
        index = self._lane_index(address.terms)
        # Lanes that take no part read past the others. There is memory for consecutive words, but not for larger steps.
        is_run = index.pattern in (ALIGNED, CONSECUTIVE) and (mask is None or index.stride == 4)
        is_eights = index.pattern == EIGHTS and index.stride == 4 and self.types.is_scalar(address.type)
        if is_run:
            at = self._write_run(base, index)
        else:
            at = self.fresh("i")
            lanes = self._index_of_lanes(index)
            self.out(f"const vu {at} = {f'({lanes}) & as_u({mask})' if mask and not is_eights else lanes};")
        if key not in self.used:
            # A load whose value is not used asks for the cache line that a later load reads.
            self.out(f"ask_for({at});" if is_run else f"ask_for_lanes<{index.stride}>({base}, {at});")
            self.trees[key] = self.types.zeros(address.type)
            return
        stride = index.stride

        def load(cpp: str, offset: int) -> str:
            if is_eights:
                return f"load_eights<{cpp}>({base} + {offset}, {at}, {mask or 'kAll'})"
            if is_run:
                return f"load_run<{cpp}, {stride}>({at} + {offset})"
            return f"gather<{cpp}, {stride}>({base} + {offset}, {at})"

        def load_four(offset: int, names: list[str]) -> str:
            where = f"{at} + {offset}" if is_run else f"{base} + {offset}, {at}"
            return f"{'load_run' if is_run else 'gather'}_four<{stride}>({where}, {', '.join(names)})"
        self.trees[key] = self._write_loads(address.type, offsets, self.stem(key), load, load_four)

    def _write_loads(self, type_: int, offsets: Any, name: str, load: Callable[[str, int], str],
                     load_four: Callable[[int, list[str]], str]) -> Tree:
        """Defines variables with the scalars of a value in memory, vectors of four at once."""
        if self.types.is_scalar(type_):
            cpp = self.types.scalar(type_, True)
            self.out(f"[[maybe_unused]] const {cpp} {name} = {load(cpp, offsets)};")
            return Leaf(name, True)
        names = [f"{name}_{i}" for i in range(len(offsets))]
        parts = self.types.parts(type_)
        if self._is_vector_of_four(type_):
            self.out(f"[[maybe_unused]] {self.types.scalar(parts[0], True)} {', '.join(names)};")
            self.out(f"{load_four(offsets[0], names)};")
            return [Leaf(x, True) for x in names]
        return [self._write_loads(part, o, x, load, load_four) for part, o, x in zip(parts, offsets, names)]

    def _texts(self, type_: int, offsets: Any, base: str) -> Texts:
        """Loads of the scalars of a value at an address that is the same for all lanes."""
        if self.types.is_scalar(type_):
            return f"load_one<{self.types.scalar(type_, False)}>({base} + {offsets})"
        return [self._texts(part, o, base) for part, o in zip(self.types.parts(type_), offsets)]

    # Stores.

    def store_memory(self, value: Key, pointer: Key, mask: str | None) -> None:
        address = self._address(pointer)
        base = self._write_base(address)
        offsets, tree = self._offsets(address.type, not address.is_shared), self.tree(value)
        if not address.terms:
            self._store_one(base, offsets, tree, mask)
            return
        index = self._lane_index(address.terms)
        is_run = index.pattern in (ALIGNED, CONSECUTIVE)
        if is_run:
            at = self._write_run(base, index)
        else:
            at = self.fresh("i")
            self.out(f"const vu {at} = {self._index_of_lanes(index)};")
        function, under = "store_run" if is_run else "scatter", f", {mask}" if mask else ""

        def store(type_: int, offset: Any, part: Any) -> None:
            if self.types.is_scalar(type_) or self._is_vector_of_four(type_):
                scalars, four, start = ([part], "", offset) if isinstance(part, Leaf) else (part, "_four", offset[0])
                where = f"{at} + {start}" if is_run else f"{base} + {start}, {at}"
                self.out(f"{function}{four}<{index.stride}>({where}, {', '.join(map(vary, scalars))}{under});")
                return
            for t, o, x in zip(self.types.parts(type_), offset, part):
                store(t, o, x)
        store(address.type, offsets, tree)

    def _store_one(self, base: str, offsets: Any, tree: Tree, mask: str | None) -> None:
        """A store of all lanes to one address: the value of the last lane stays. All scalars of a value come from the
        same lane."""
        if isinstance(tree, list):
            for offset, part in zip(offsets, tree):
                self._store_one(base, offset, part, mask)
        elif tree.varying:
            self.out(f"store_last({base} + {offsets}, {tree.text}, {mask or 'kAll'});")
        else:
            self.out(f"store_one({base} + {offsets}, {tree.text});")

    # Atomics.

    def atomic(self, n: InstructionNode, mask: str | None) -> None:
        # Before the operands come the scope and the semantics; a comparison has two semantics.
        operands = n.args[4 if n.inst.op == Op.AtomicCompareExchange else 3:]
        values = ", ".join(vary(self.leaf(operand)) for operand in operands if operand is not None)
        address = self._address(n.operand(0))
        index, stride = "vu{}", 4
        if address.terms:
            lane_index = self._lane_index(address.terms)
            index, stride = self._index_of_lanes(lane_index), lane_index.stride
        is_shared, is_used = (str(flag).lower() for flag in (address.is_shared, n.key in self.used))
        function = f"{ATOMIC_FUNCTIONS[n.inst.op]}<{stride}, {is_shared}, {is_used}>"
        call = f"{function}({address.base}, {index}, {values}, {mask or 'kAll'})"
        self.define(n.result(), n.inst.type, call, True)

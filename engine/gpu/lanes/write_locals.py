"""The C++ of a kernel's local variables, under masks where lanes part."""
from __future__ import annotations

from typing import NamedTuple

from calls import Key
from expressions import INTEGERS, pick
from nodes import InstructionNode, LoopNode, Node, Path, PhiNode, ReturnNode, Step
from parts import Leaf, Tree, as_lanes, each, first, vary
from patterns import VARYING, Patterns
from spirv import fail
from spirv_names import Op, StorageClass
from writer_base import WriterBase


class Place(NamedTuple):
    """The target of a pointer to a local variable. If lanes differ in an index: that index, and the number of parts it
    selects from; `tree` is then one of these parts."""

    tree: Tree
    varying: Key | None
    count: int


class LocalsWriter(WriterBase):
    """Part of Writer (write_cpp.py)."""

    def _place(self, pointer_key: Key, at: int = 0) -> Place:
        """The place of a pointer. at: the value to use for an index in which lanes differ."""
        pointer = self.program.pointer(pointer_key)
        tree = self.trees[pointer.root]
        varying, count = None, 0
        for index in pointer.indices:
            assert isinstance(tree, list)
            known = self.number(index)
            if known is None and self.differs(index):
                if varying is not None:
                    fail(f"{self.module.path}: two indices into a variable differ between lanes; use one")
                varying, count, known = index, len(tree), at
            if known is not None:
                tree = tree[min(known, len(tree) - 1)]  # larger only in code that never runs
            else:
                tree = self._at_run_time(tree, first(self.leaf(index)), pointer.root)
        return Place(tree, varying, count)

    def _at_run_time(self, parts: list[Tree], index: str, root: Key) -> Tree:
        """The part of a C++ array that an expression selects."""
        if len(parts) == 1:
            return parts[0]

        def with_index(a: Leaf, b: Leaf) -> Leaf:
            # The texts of two parts differ in the index of the part only.
            end = next((i for i, (x, y) in enumerate(zip(a.text, b.text)) if x != y), None)
            if end is None or a.text[end - 1] != "[":
                fail(f"{self.module.path}: {self.stem(root)} has an index that is not known during translation")
            return Leaf(a.text[:end] + index + a.text[a.text.index("]", end):], a.varying)
        return each(with_index, parts[0], parts[1])

    def _masks_of(self, path: Path) -> list[Step]:
        return [step for step in path if self.uniformity.is_divergent(step)]

    def _home(self, key: Key) -> list[Step] | None:
        """The masked scopes that all accesses of a variable are in."""
        accesses = self.program.accesses[key]
        if any(isinstance(a.node, (PhiNode, ReturnNode)) for a in accesses):
            return None
        paths = [self._masks_of(a.path) for a in accesses]
        shared = paths[0]
        for path in paths[1:]:
            n = 0
            while n < min(len(path), len(shared)) and path[n] == shared[n]:
                n += 1
            shared = shared[:n]
        return shared

    # Stores.

    def store_local(self, n: InstructionNode, mask: str | None) -> None:
        target = n.operand(0)
        pointer, place, value = self.program.pointer(target), self._place(target), self.tree(n.operand(1))
        home = self._home(pointer.root) if mask is not None else None
        if home and home == self._masks_of(n.path) and not self.uniformity.carries(pointer.root, home):
            mask = None  # nothing outside this scope reads the variable
        positions, type_ = self.uniformity.positions(pointer.type, pointer.indices)
        if place.varying is None:
            pattern = self.uniformity.part(self.pattern(pointer.root), positions)
            self.assign(place.tree, value, pattern, type_, mask)
            return
        lanes = self.leaf(place.varying).text
        for i in range(place.count):
            here = self.fresh("m")
            self.out(f"const vm {here} = {mask + ' & ' if mask else ''}vm{{(vi)(as_u({lanes}) == {i}u)}};")
            each(lambda t, v: self.out(f"{t.text} = select({here}, {vary(v)}, {t.text});"),
                 self._place(target, i).tree, value)

    def assign(self, target: Tree, value: Tree, p: Patterns, type_: int, mask: str | None) -> None:
        """Stores a value in the lanes of the mask. A scalar whose pattern is not VARYING is stored in all lanes: all
        readers then have it in every lane, and may ask any lane for it."""
        if isinstance(target, Leaf):
            assert isinstance(value, Leaf)
            text = as_lanes(value, target.varying)
            if mask is not None and p == VARYING:
                text = f"select({mask}, {text}, {target.text})"
            self.out(f"{target.text} = {text};")
            return
        assert isinstance(value, list)
        patterns, types = self.types.part_patterns(type_, p), self.types.parts(type_)
        for t, v, pattern, part in zip(target, value, patterns, types):
            self.assign(t, v, pattern, part, mask)

    # Loads.

    def load_local(self, n: InstructionNode) -> None:
        pointer, key = n.operand(0), n.result()
        root = self.program.pointer(pointer).root
        if root in self.counting:
            self.known[key] = self.counting[root]
            self.trees[key] = self.types.number(n.inst.type, self.counting[root])
            return
        place = self._place(pointer)
        wanted = self.wanted(n.inst.type, self.pattern(key))
        if place.varying is None:
            texts = each(as_lanes, place.tree, wanted)
        else:
            parts = [self._place(pointer, i).tree for i in range(place.count)]
            lanes = self.leaf(place.varying)
            texts = each(lambda w, *leaves: pick(list(leaves), lanes, w), wanted, *parts)
        self.define(key, n.inst.type, texts, wanted)

    # C++ arrays.

    def find_indexed(self) -> None:
        """Finds the kinds of composites, by variable, that must be C++ arrays: their parts are selected by an index
        that is the same for all lanes and not known during translation."""
        counters = self._unrolled_counters([self.program.tree])
        for n in self.program.instructions:
            if n.inst.op not in (Op.Load, Op.Store):
                continue
            pointer = self.program.pointer(n.operand(0))
            if pointer.storage != StorageClass.Function:
                continue
            type_ = pointer.type
            for index in pointer.indices:
                t = self.types.of(type_)
                if t.op == Op.TypeStruct:
                    member = self.module.constant(index.id)
                    assert isinstance(member, int)
                    type_ = t.args[member]
                    continue
                if not self._will_be_known(index, counters) and not self.differs(index):
                    self.indexed.setdefault(pointer.root, set()).add(t.op)
                type_ = t.args[0]

    def _unrolled_counters(self, nodes: list[Node]) -> set[Key]:
        """The counters of all loops that are unrolled."""
        counters: set[Key] = set()
        for n in nodes:
            if isinstance(n, LoopNode) and self.unrolled(n) is not None:
                counters.add(self.counter(n))
            for children in n.children():
                counters |= self._unrolled_counters(children)
        return counters

    def _will_be_known(self, key: Key, counters: set[Key]) -> bool:
        """Whether an index will be known once loops are unrolled."""
        if key not in self.program.types:
            return self.module.constant(key.id) is not None
        n = self.makers.get(key)
        if n is None:
            return False
        if n.inst.op == Op.Load:
            pointer = self.program.pointer(n.operand(0))
            return pointer.storage == StorageClass.Function and pointer.root in counters and not pointer.indices
        return n.inst.op in INTEGERS and all(a is not None and self._will_be_known(a, counters) for a in n.args)

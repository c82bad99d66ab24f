"""Finds out which values are the same for all lanes."""
from __future__ import annotations

from typing import Union

from calls import Key
from expressions import BINARY, COMPARE
from nodes import (AccessNode, CallNode, Exit, IfNode, InstructionNode, LoopNode, Path, PhiNode, RestNode, ReturnNode,
                   Step)
from patterns import (ALIGNED, COMPONENT, CONSECUTIVE, EIGHTS, HALVES, QUARTER, UNIFORM, VARYING, Pattern, Patterns,
                      components, is_uniform, join, leaves)
from program import Access, Program
from spirv_names import ATOMICS, CONVERSIONS, BuiltIn, Decoration, Op, StorageClass

# Patterns of a variable while its stores are joined; None: nothing was stored yet.
Joined = Union[Pattern, None, list["Joined"]]

COMPONENTWISE = frozenset({*BINARY, *COMPARE, *CONVERSIONS, Op.Select, Op.FNegate})


class Uniformity:
    """The pattern of every value of a program, and the exits that lanes take one by one, under a mask.

    Starts from the assumption that everything is uniform, and weakens it until nothing changes."""

    def __init__(self, program: Program) -> None:
        self.program, self.module = program, program.module
        self.patterns: dict[Key, Patterns] = {key: self.filled(t, UNIFORM) for key, t in program.types.items()}
        self.masked: set[Exit] = set()
        self._users = self._find_users()
        self._stale = {n.key for n in program.instructions if n.key is not None} | set(program.accesses)
        while self._update():
            pass

    def of(self, key: Key) -> Patterns:
        if key in self.patterns:
            return self.patterns[key]
        return self.filled(self.module.ids[key.id].type, UNIFORM)  # a constant

    def filled(self, type_: int, pattern: Pattern) -> Patterns:
        """The pattern of a value of a type whose scalars all have `pattern`."""
        t = self.program.type(type_)
        if t.op == Op.TypeVector:
            return [pattern] * t.args[1]
        if t.op == Op.TypeStruct:
            return [self.filled(part, pattern) for part in t.args]
        if t.op in (Op.TypeArray, Op.TypeMatrix):
            return [self.filled(t.args[0], pattern)]
        return pattern

    def positions(self, type_: int, indices: list[Key]) -> tuple[list[int | None], int]:
        """Positions in the pattern of a value for indices into it, and the type of that part. None: any part of a
        vector."""
        found: list[int | None] = []
        for index in indices:
            t = self.program.type(type_)
            known = self.module.constant(index.id)
            position = None if known is None else int(known)
            found.append(0 if t.op in (Op.TypeArray, Op.TypeMatrix, Op.TypeRuntimeArray) else position)
            type_ = self.program.part_type(type_, position or 0)
        return found, type_

    def part(self, p: Patterns, positions: list[int | None]) -> Patterns:
        """The part of a pattern at given positions."""
        for n, position in enumerate(positions):
            parts = components(p)
            if position is None:
                return self.part(parts[0], positions[n + 1:]) if all(x == parts[0] for x in parts) else VARYING
            p = parts[position]
        return p

    # Divergence.

    def is_divergent(self, step: Step) -> bool:
        """Whether only some of the lanes may take a step into a node."""
        node = step.node
        if isinstance(node, IfNode):
            return not is_uniform(self.of(node.condition))
        if isinstance(node, (RestNode, LoopNode)):
            return not self.masked.isdisjoint(node.exits)
        assert isinstance(node, CallNode)
        return node.return_ in self.masked

    def _update_masked(self) -> bool:
        changed = False
        for exit_, sites in self.program.exit_sites.items():
            if exit_ not in self.masked and any(self._leaves_one_by_one(exit_, path) for path in sites):
                self.masked.add(exit_)
                changed = True
        # If lanes leave a loop one by one in one way, all ways out of it use masks.
        for loop in self.program.loops:
            own = {loop.break_, loop.continue_}
            if not self.masked.isdisjoint(loop.exits) and not own <= self.masked:
                self.masked |= own
                changed = True
        return changed

    def _leaves_one_by_one(self, exit_: Exit, path: Path) -> bool:
        """Whether the lanes have parted between the loop or call that an exit leaves and the exit itself."""
        inside = False
        for step in path:
            if inside and self.is_divergent(step):
                return True
            inside = inside or self._is_left_by(exit_, step)
        return False

    @staticmethod
    def _is_left_by(exit_: Exit, step: Step) -> bool:
        kind = CallNode if exit_.kind == "return" else LoopNode
        return isinstance(step.node, kind) and step.node.number == exit_.number

    # The fixed point.

    def _find_users(self) -> dict[Key, set[Key]]:
        """The results and variables whose patterns follow from the pattern of each value."""
        users: dict[Key, set[Key]] = {}
        for n in self.program.instructions:
            if n.key is not None:
                for key in self._read_by(n):
                    users.setdefault(key, set()).add(n.key)
        for variable, accesses in self.program.accesses.items():
            for access in accesses:
                conditions = [step.node.condition for step in access.path if isinstance(step.node, IfNode)]
                for key in [*self._read_by(access.node), *conditions]:
                    users.setdefault(key, set()).add(variable)
        return users

    def _read_by(self, n: AccessNode) -> list[Key]:
        """The values that a node reads, with the variable or address and the indices of a pointer."""
        if isinstance(n, (PhiNode, ReturnNode)):
            return [] if n.value is None else [n.value]
        keys = [key for key in n.args if key is not None]
        if n.inst.op in (Op.Load, Op.Store):
            pointer = self.program.pointer(n.operand(0))
            keys += [pointer.root, *pointer.indices]
        return keys

    def _update(self) -> bool:
        """Computes what is stale once, in order of execution. Returns whether anything was."""
        while self._update_masked():
            self._stale.update(self.program.accesses)
        if not self._stale:
            return False
        for n in self.program.instructions:
            if n.key in self._stale:
                self._set(n.key, self._after(n))
        for key, accesses in self.program.accesses.items():
            if key in self._stale:
                self._set(key, self._of_variable(key, accesses))
        return True

    def _set(self, key: Key, pattern: Patterns) -> None:
        self._stale.discard(key)
        if self.patterns[key] != pattern:
            self.patterns[key] = pattern
            self._stale |= self._users.get(key, set())

    # Variables.

    def _of_variable(self, key: Key, accesses: list[Access]) -> Patterns:
        joined = self._nothing(self.program.types[key])
        for access in accesses:
            if not access.is_store:
                continue
            positions, value = self._stored(access)
            if not self._seen_by_all(key, access, accesses):
                value = self.filled(self._type_at(key, positions), VARYING)
            joined = self._put(joined, positions, value)
        return self._settled(joined)

    def _nothing(self, type_: int) -> Joined:
        def cleared(p: Patterns) -> Joined:
            return [cleared(part) for part in p] if isinstance(p, list) else None
        return cleared(self.filled(type_, UNIFORM))

    def _stored(self, access: Access) -> tuple[list[int | None], Patterns]:
        """The positions that a store writes to, and the pattern of the value."""
        n = access.node
        if isinstance(n, (PhiNode, ReturnNode)):
            assert n.value is not None
            return [], self.of(n.value)
        pointer = self.program.pointer(n.operand(0))
        positions, part = self.positions(pointer.type, pointer.indices)
        if any(not is_uniform(self.of(index)) for index in pointer.indices):
            return positions, self.filled(part, VARYING)
        return positions, self.of(n.operand(1))

    def _type_at(self, key: Key, positions: list[int | None]) -> int:
        type_ = self.program.types[key]
        for position in positions:
            type_ = self.program.part_type(type_, position or 0)
        return type_

    def _put(self, joined: Joined, positions: list[int | None], value: Patterns) -> Joined:
        """`joined` after another store."""
        if not positions:
            return self._joined(joined, value)
        assert isinstance(joined, list)
        out = list(joined)
        for i in range(len(out)) if positions[0] is None else [positions[0]]:
            out[i] = self._put(out[i], positions[1:], value)
        return out

    def _joined(self, a: Joined, b: Patterns) -> Joined:
        if a is None:
            return b
        if isinstance(a, Pattern) or isinstance(b, Pattern):
            return a if a == b else VARYING
        return [self._joined(x, y) for x, y in zip(a, b)]

    def _settled(self, joined: Joined) -> Patterns:
        """Parts that nothing is stored to are uniform."""
        if isinstance(joined, list):
            return [self._settled(part) for part in joined]
        return UNIFORM if joined is None else joined

    def _seen_by_all(self, key: Key, store: Access, accesses: list[Access]) -> bool:
        """Whether all lanes that read the variable later have taken part in a store."""
        path = store.path
        divergent = [i for i, step in enumerate(path) if self.is_divergent(step)]
        if not divergent:
            return True
        inner = divergent[-1]
        if isinstance(accesses[0].node, (PhiNode, ReturnNode)):
            return inner < self._home_of_result(accesses, path)
        scope = path[:inner + 1]
        inside = [a for a in accesses if a.path[:inner + 1] == scope]
        outside = [a for a in accesses if a.path[:inner + 1] != scope]
        first = min(inside, key=lambda a: a.order)
        fresh = self._sets_all(first) and all(a.path[:len(first.path)] == first.path for a in inside)
        is_read_outside = any(not a.is_store for a in outside)
        if (fresh or not self._runs_again(key, path, inner)) and not is_read_outside:
            return True
        if scope[-1].part == "loop":
            return bool(outside) and all(
                a.is_store and a.path == path[:inner] and a.order < first.order for a in outside)
        return False

    @staticmethod
    def _home_of_result(accesses: list[Access], path: Path) -> int:
        """How many steps of a path lead to where the result of a call, or a phi, is read: there all lanes of the call,
        or of the branches, go on together."""
        node = accesses[0].node
        if isinstance(node, ReturnNode):
            return next(i for i, step in enumerate(path)
                        if isinstance(step.node, CallNode) and step.node.number == node.call)
        home = path
        for access in accesses:
            while access.path[:len(home)] != home:
                home = home[:-1]
        return len(home)

    def _sets_all(self, access: Access) -> bool:
        """Whether an access stores a variable as a whole."""
        if not access.is_store:
            return False
        n = access.node
        return not isinstance(n, InstructionNode) or not self.program.pointer(n.operand(0)).indices

    @staticmethod
    def _runs_again(key: Key, path: Path, scope: int) -> bool:
        """Whether step `scope` of a path may run more than once while the variable lives: a call has variables of its
        own."""
        births = (i for i, step in enumerate(path)
                  if isinstance(step.node, CallNode) and step.node.number == key.call)
        birth = next(births, -1)
        return any(step.part == "loop" for step in path[birth + 1:scope])

    def carries(self, key: Key, home: list[Step]) -> bool:
        """Whether a variable, all of whose accesses are in the masked scope `home`, may carry a value from one run of
        that scope to the next."""
        accesses = self.program.accesses[key]
        first = min(accesses, key=lambda a: a.order)
        if self._sets_all(first) and all(a.path[:len(first.path)] == first.path for a in accesses):
            return False
        return self._runs_again(key, first.path, first.path.index(home[-1]))

    # Instructions.

    def _after(self, n: InstructionNode) -> Patterns:
        """The pattern of an instruction's result."""
        inst, op = n.inst, n.inst.op
        if op == Op.Load:
            return self._loaded(n)
        if op in ATOMICS:
            return VARYING
        operands = [self.of(a) for a in n.args if a is not None]
        if op == Op.CompositeConstruct:
            return self._constructed(inst.type, operands)
        if op == Op.CompositeExtract:
            return self._extracted(n)
        if op in (Op.CopyObject, Op.CopyLogical):
            return operands[0]
        if op == Op.VectorShuffle:
            both = [*components(operands[0]), *components(operands[1])]
            return [both[i] for i in inst.args[2:]]
        return self._computed(n, operands)

    def _loaded(self, n: InstructionNode) -> Patterns:
        type_ = n.inst.type
        pointer = self.program.pointer(n.operand(0))
        if pointer.storage == StorageClass.Input:
            name = self.module.decorations[pointer.root.id][Decoration.BuiltIn][0]
            return ALIGNED if name == BuiltIn.LocalInvocationIndex else self.filled(type_, UNIFORM)
        is_same = all(is_uniform(self.of(index)) for index in pointer.indices)
        if pointer.storage == StorageClass.Function:
            if not is_same:
                return self.filled(type_, VARYING)
            positions, _ = self.positions(pointer.type, pointer.indices)
            return self.part(self.of(pointer.root), positions)
        if pointer.storage == StorageClass.PhysicalStorageBuffer:
            is_same = is_same and is_uniform(self.of(pointer.root))
        return self.filled(type_, UNIFORM if is_same else VARYING)

    def _constructed(self, type_: int, operands: list[Patterns]) -> Patterns:
        kind = self.program.type(type_).op
        if kind == Op.TypeStruct:
            return operands
        if kind == Op.TypeVector:
            return [x for operand in operands for x in (operand if isinstance(operand, list) else [operand])]
        joined = operands[0]
        for operand in operands[1:]:
            joined = join(joined, operand)
        return [joined]

    def _extracted(self, n: InstructionNode) -> Patterns:
        pattern, type_ = self.of(n.operand(0)), self.program.type_of(n.operand(0))
        for index in n.inst.args[1:]:
            is_array = self.program.type(type_).op in (Op.TypeArray, Op.TypeMatrix)
            pattern = components(pattern)[0 if is_array else index]
            type_ = self.program.part_type(type_, index)
        return pattern

    def _computed(self, n: InstructionNode, operands: list[Patterns]) -> Patterns:
        inst, op = n.inst, n.inst.op
        if all(is_uniform(p) for p in operands):
            return self.filled(inst.type, UNIFORM)
        if all(x in (UNIFORM, HALVES) for p in operands for x in leaves(p)):
            return self.filled(inst.type, HALVES)
        if op == Op.Bitcast and isinstance(operands[0], Pattern):
            return operands[0]
        t = self.program.type(inst.type)
        if t.op == Op.TypeInt and op != Op.ExtInst and len(operands) == 2:
            a, b = operands
            if isinstance(a, Pattern) and isinstance(b, Pattern):
                return self._of_integer(n, a, b)
        if t.op == Op.TypeVector and op in COMPONENTWISE:
            def is_same(i: int) -> bool:
                return all((p[i] if isinstance(p, list) else p) == UNIFORM for p in operands)
            return [UNIFORM if is_same(i) else VARYING for i in range(t.args[1])]
        return self.filled(inst.type, VARYING)

    def _of_integer(self, n: InstructionNode, a: Pattern, b: Pattern) -> Pattern:
        """The pattern of an integer computed from two scalars that are not both uniform."""
        op, width = n.inst.op, self.program.width
        left, right = n.operand(0), n.operand(1)
        constant = self.module.constant(right.id)
        k = constant if isinstance(constant, int) else None
        if op == Op.IAdd:
            return self._of_sum(left, right, a, b)
        if op == Op.ISub and b == UNIFORM and a in (ALIGNED, CONSECUTIVE):
            return ALIGNED if a == ALIGNED and k is not None and k % width == 0 else CONSECUTIVE
        if op == Op.IMul and k == 1:
            return a
        if a != ALIGNED or k is None:
            return VARYING
        if k == 8 and width == 16 and op in (Op.UDiv, Op.UMod):
            return HALVES if op == Op.UDiv else EIGHTS
        if op == Op.UMod and k % width == 0:
            return ALIGNED
        if op == Op.UDiv and k % width == 0:
            return UNIFORM
        if op == Op.ShiftRightLogical and (1 << k) % width == 0:
            return UNIFORM
        if op == Op.ShiftRightLogical and k == 2:
            return QUARTER
        if op == Op.BitwiseAnd and k == 3 and width > 4:
            return COMPONENT
        is_low_bits = (k + 1) & k == 0
        if op == Op.BitwiseAnd and is_low_bits and (k + 1) % width == 0:
            return ALIGNED
        return VARYING

    def _of_sum(self, left: Key, right: Key, a: Pattern, b: Pattern) -> Pattern:
        both = {a, b}
        if both == {UNIFORM, ALIGNED}:
            return ALIGNED if self._is_multiple(right.id if b == UNIFORM else left.id) else CONSECUTIVE
        if both == {UNIFORM, CONSECUTIVE}:
            return CONSECUTIVE
        if both == {UNIFORM, QUARTER}:
            return QUARTER
        if both in ({UNIFORM, EIGHTS}, {HALVES, EIGHTS}):
            return EIGHTS
        return VARYING

    def _is_multiple(self, id_: int) -> bool:
        """Whether a value is known to be a multiple of the width: a constant, or a product with one."""
        k, inst = self.module.constant(id_), self.module.ids[id_]
        if k is not None:
            return k % self.program.width == 0
        return inst.op == Op.IMul and any(self._is_multiple(x) for x in inst.args)

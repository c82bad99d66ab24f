"""The C++ of branches, loops and calls, under masks where lanes part."""
from __future__ import annotations

from typing import NamedTuple

from calls import Key
from nodes import CallNode, Exit, IfNode, InstructionNode, LeaveNode, LoopNode, Node, PhiNode, RestNode, ReturnNode
from parts import Leaf
from spirv_names import Op
from writer_base import WriterBase, children_in_call

MAX_UNROLLED = 32  # iterations


def and_mask(mask: str | None, condition: str) -> str:
    return f"{mask} & {condition}" if mask else condition


class CountedLoop(NamedTuple):
    """The instructions of a loop that counts: load, compare and branch at its head; load, add and store in its tail."""

    load: InstructionNode
    compare: InstructionNode
    tail_load: InstructionNode
    add: InstructionNode
    store: InstructionNode


class ControlWriter(WriterBase):
    """Part of Writer (write_cpp.py)."""

    def block(self, nodes: list[Node], mask: str | None) -> None:
        for n in nodes:
            if isinstance(n, InstructionNode):
                self.instruction(n, mask)
            elif isinstance(n, PhiNode):
                # The phi of the block before a branch comes first, for all lanes. Each way then sets that of its lanes.
                self.assign(self.trees[n.key], self.tree(n.value), self.pattern(n.key), n.type, mask)
            elif isinstance(n, IfNode):
                self._branch(n, mask)
            elif isinstance(n, RestNode):
                self._rest(n, mask)
            elif isinstance(n, LoopNode):
                self._loop(n, mask)
            elif isinstance(n, CallNode):
                self.inline(n, mask)
            elif isinstance(n, LeaveNode):
                self._leave(n, mask)
            elif isinstance(n, ReturnNode):
                self._return(n, mask)

    def _declare_phis(self, nodes: list[Node], done: set[Key]) -> None:
        """Declares the phis inside `nodes`, before these."""
        for n in nodes:
            if isinstance(n, PhiNode) and n.key not in done:
                done.add(n.key)
                self.declare(n.key, n.type)
            for children in children_in_call(n):
                self._declare_phis(children, done)

    def _scope(self, head: str, nodes: list[Node], mask: str | None) -> None:
        self.out(head + "{")
        self.depth += 1
        self.block(nodes, mask)
        self.depth -= 1
        self.out("}")

    # Branches.

    def _branch(self, n: IfNode, mask: str | None) -> None:
        if not n.then and not n.other:
            return
        condition, known = self.leaf(n.condition), self.number(n.condition)
        if known is not None:
            self.block(n.then if known else n.other, mask)
        elif condition.varying:
            self._masked_branch(n, condition, mask)
        elif n.then:
            self._scope(f"if ({condition.text}) ", n.then, mask)
            if n.other:
                self._scope("else ", n.other, mask)
        else:
            self._scope(f"if (!({condition.text})) ", n.other, mask)

    def _masked_branch(self, n: IfNode, condition: Leaf, mask: str | None) -> None:
        yes, no = self.fresh("m"), self.fresh("m")
        if n.then:
            self.out(f"const vm {yes} = {and_mask(mask, condition.text)};")
        if n.other:
            self.out(f"const vm {no} = {and_mask(mask, '~' + condition.text)};")
        if n.then:
            self._scope(f"if (any({yes})) ", n.then, yes)
        if n.other:
            self._scope(f"if (any({no})) ", n.other, no)

    def _rest(self, n: RestNode, mask: str | None) -> None:
        gone = [self.exit_masks[e] for e in sorted(n.exits) if self.is_masked(e)]
        if not gone:
            self.block(n.body, mask)
            return
        left = self.fresh("m")
        self.out(f"const vm {left} = {and_mask(mask, ' & '.join('~' + g for g in gone))};")
        self._scope(f"if (any({left})) ", n.body, left)

    # Exits.

    def _leave(self, n: LeaveNode, mask: str | None) -> None:
        if self.is_masked(n.exit):
            self._mark_gone(n.exit, mask)
        else:
            self._goto(f"{n.kind}_{n.loop.label}")

    def _return(self, n: ReturnNode, mask: str | None) -> None:
        if n.value is not None and n.result is not None:
            self.assign(self.trees[n.result], self.tree(n.value), self.pattern(n.result), self.program.types[n.result],
                        mask)
        if self.is_masked(n.exit):
            self._mark_gone(n.exit, mask)
        elif n not in self.last_returns:
            self._goto(self.return_labels[n.call])

    def _mark_gone(self, exit_: Exit, mask: str | None) -> None:
        self.out(f"{self.exit_masks[exit_]} |= {mask or 'kAll'};")

    def _goto(self, label: str) -> None:
        self.labels.add(label)
        self.out(f"goto {label};")

    def _label(self, label: str) -> None:
        """A label, if anything jumps to it."""
        if label in self.labels:
            self.out(f"{label}:;")

    # Loops.

    def _loop(self, n: LoopNode, mask: str | None) -> None:
        n.label = self.fresh("")
        self._declare_phis(n.body + n.tail, set())
        if any(self.is_masked(e) for e in n.exits):
            self._masked_loop(n, mask)
            return
        numbers = self.unrolled(n)
        if numbers is not None:
            self._unrolled_loop(n, numbers, mask)
            return
        self.out("for (;;) {")
        self.depth += 1
        self._scope("", n.body, mask)
        self._label(f"continue_{n.label}")
        self.block(n.tail, mask)
        self.depth -= 1
        self.out("}")
        self._label(f"break_{n.label}")

    def _unrolled_loop(self, n: LoopNode, numbers: range, mask: str | None) -> None:
        counter = self.counter(n)
        outside = dict(self.known)
        for i in numbers:
            self.counting[counter] = i
            n.label = self.fresh("")
            self._scope("", n.body, mask)
            self._label(f"continue_{n.label}")
        del self.counting[counter]
        self.known = outside
        after, last = self.leaf(counter), str(numbers.stop)
        if after.varying:
            self.out(f"{after.text} = {self.types.scalar(self.program.types[counter], True)}{{}} + {last};")
        else:
            self.out(f"{after.text} = {last};")

    def _masked_loop(self, n: LoopNode, mask: str | None) -> None:
        """A loop that lanes leave one by one: it ends when no lane is left."""
        gone, waits = self.fresh("gone"), self.fresh("waits")
        self.exit_masks[n.break_], self.exit_masks[n.continue_] = gone, waits
        outer = [self.exit_masks[e] for e in sorted(n.exits - {n.break_, n.continue_}) if self.is_masked(e)]
        remaining = " & ".join(f"~{m}" for m in [gone, *outer])
        self.out(f"vm {gone} = {'~' + mask if mask else 'vm{}'};")
        self.out("for (;;) {")
        self.depth += 1
        active = self.fresh("m")
        self.out(f"vm {waits}{{}};")
        self.out(f"const vm {active} = {remaining};")
        self.out(f"if (!any({active})) break;")
        self._scope("", n.body, active)
        tail = self.fresh("m")
        if n.tail:
            self.out(f"[[maybe_unused]] const vm {tail} = {remaining};")
            self._scope(f"if (any({tail})) ", n.tail, tail)
        self.out(f"(void){waits};")
        self.depth -= 1
        self.out("}")

    # Loops that are unrolled.

    def counter(self, n: LoopNode) -> Key:
        """The variable that the tail of a loop adds to."""
        return self._root_of(n.tail[2])

    def _root_of(self, n: Node) -> Key:
        """The variable that a load or store accesses."""
        assert isinstance(n, InstructionNode)
        return self.program.pointer(n.operand(0)).root

    def unrolled(self, n: LoopNode) -> range | None:
        """The values of the counter if the loop is to be unrolled; None if not. It must ask for that, count from one
        constant to another, and have no other exit."""
        if not n.unroll or any(self.is_masked(e) for e in n.exits) or self._count_exits(n) != 1:
            return None
        counted = self._counted(n)
        if counted is None:
            return None
        counter = self.counter(n)
        if self._root_of(counted.load) != counter or self._root_of(counted.tail_load) != counter:
            return None
        other_stores = [a.node for a in self.program.accesses[counter] if a.is_store and a.node is not counted.store]
        if len(other_stores) != 1 or not isinstance(other_stores[0], InstructionNode):
            return None
        start = self._constant_operand(other_stores[0])
        end, step = self._constant_operand(counted.compare), self._constant_operand(counted.add)
        if start is None or end is None or step is None or step < 1:
            return None
        numbers = range(start, end, step)
        return numbers if len(numbers) <= MAX_UNROLLED else None

    @staticmethod
    def _counted(n: LoopNode) -> CountedLoop | None:
        """The instructions of a loop, if they are those of a loop that counts."""
        head, tail = n.body[:3], n.tail
        if len(head) < 3 or len(tail) != 3:
            return None
        load, compare, branch = head
        if not isinstance(load, InstructionNode) or not isinstance(compare, InstructionNode):
            return None
        if load.inst.op != Op.Load or compare.inst.op not in (Op.ULessThan, Op.SLessThan):
            return None
        instructions = [x for x in tail if isinstance(x, InstructionNode)]
        if not isinstance(branch, IfNode) or [x.inst.op for x in instructions] != [Op.Load, Op.IAdd, Op.Store]:
            return None
        return CountedLoop(load, compare, *instructions)

    def _constant_operand(self, n: InstructionNode) -> int | None:
        """The second operand, if it is a constant."""
        value = self.module.constant(n.operand(1).id)
        return value if isinstance(value, int) else None

    def _count_exits(self, loop: LoopNode) -> int:
        def count(nodes: list[Node]) -> int:
            total = 0
            for n in nodes:
                if isinstance(n, ReturnNode) or (isinstance(n, LeaveNode) and n.exit == loop.break_):
                    total += 1
                total += sum(count(children) for children in children_in_call(n))
            return total
        return count(loop.body) + count(loop.tail)

    # Calls.

    def inline(self, n: CallNode, mask: str | None) -> None:
        if n.result is not None:
            self.declare(n.result, self.program.types[n.result])
        if self.is_masked(n.return_):
            self.exit_masks[n.return_] = self.fresh("returned")
            self.out(f"vm {self.exit_masks[n.return_]}{{}};")
        label = self.return_labels[n.number] = f"return_{n.number}_{self.fresh('')}"
        if n.body and isinstance(n.body[-1], ReturnNode):
            self.last_returns.add(n.body[-1])
        self._declare_phis(n.body, set())
        self._scope("", n.body, mask)
        self._label(label)

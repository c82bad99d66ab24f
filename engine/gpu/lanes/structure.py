"""Turns the basic blocks of a SPIR-V function into a tree (nodes.py)."""
from __future__ import annotations

from typing import NamedTuple, Union

from calls import Call, Key
from nodes import CallNode, IfNode, InstructionNode, LeaveNode, LoopNode, Node, PhiNode, ReturnNode
from spirv import Function, Instruction, Module, fail, unknown
from spirv_names import LoopControl, Op

CONTROL_FLOW = frozenset({
    Op.Phi, Op.LoopMerge, Op.SelectionMerge, Op.Branch, Op.BranchConditional, Op.Return, Op.ReturnValue,
    Op.Unreachable})


class RegionEnd:
    """A jump to the end of the region that is being read."""


REGION_END = RegionEnd()

# A jump: out of the region, to its end, or (None) to a block within it.
Jump = Union[LeaveNode, RegionEnd, None]


class Conditional(NamedTuple):
    """A BranchConditional: its condition and the labels of the two targets."""

    condition: int
    yes: int
    no: int


class Structurer:
    """Builds the tree of one call of a function, with the calls in it. types: receives the types of their results."""

    def __init__(self, module: Module, function: Function, arguments: list[Key], types: dict[Key, int]) -> None:
        self.module, self.function, self.types = module, function, types
        self.call = Call(function, arguments)
        self.loops: list[LoopNode] = []  # those around the block that is being read, the innermost last
        self.result: Key | None = None
        result_type = function.inst.type
        if module.ids[result_type].op != Op.TypeVoid:
            self.result = Key.of_result(self.call.number)
            types[self.result] = result_type

    def tree(self) -> CallNode:
        return CallNode(self._region(self.function.first, None), self.call.number, self.result)

    def _phis(self, target: int, source: int) -> list[Node]:
        """The values that phis of the block `target` take if control comes from the block `source`."""
        phis: list[Node] = []
        for inst in self.function.blocks[target]:
            if inst.op != Op.Phi:
                break
            for value, predecessor in zip(inst.args[::2], inst.args[1::2]):
                if predecessor == source:
                    phis.append(PhiNode(self.call.key(inst.id), inst.type, self.call.key(value)))
        return phis

    def _jump(self, target: int, stop: int | None) -> Jump:
        if target == stop:
            return REGION_END
        if self.loops:
            loop = self.loops[-1]
            if target == loop.merge:
                return LeaveNode("break", loop)
            if target == loop.continue_target:
                return LeaveNode("continue", loop)
        return None

    def _region(self, label: int, stop: int | None, entered: bool = False) -> list[Node]:
        """The nodes from the block `label` up to the block `stop`. entered: `label` is the head of a loop whose node
        exists already."""
        nodes: list[Node] = []
        following: int | None = label
        while following is not None:
            label = following
            merge = self._merge_of(label)
            if merge is not None and merge.op == Op.LoopMerge and not entered:
                loop = self._loop(label, merge)
                nodes.append(loop)
                following = loop.merge
                continue
            entered = False
            nodes += self._instructions(label)
            following = self._terminator(label, merge, stop, nodes)
        return nodes

    def _merge_of(self, label: int) -> Instruction | None:
        merges = (inst for inst in self.function.blocks[label] if inst.op in (Op.LoopMerge, Op.SelectionMerge))
        return next(merges, None)

    def _loop(self, label: int, merge: Instruction) -> LoopNode:
        if any(inst.op == Op.Phi for inst in self.function.blocks[label]):
            fail(f"{self.module.path}: a loop has a phi; values that change between iterations must be variables")
        merge_label, continue_label, control = merge.args[:3]
        loop = LoopNode(merge_label, continue_label, bool(control & LoopControl.Unroll))
        self.loops.append(loop)
        loop.body = self._region(label, continue_label, entered=True)
        loop.tail = self._region(continue_label, label) if continue_label != label else []
        self.loops.pop()
        return loop

    def _instructions(self, label: int) -> list[Node]:
        nodes: list[Node] = []
        for inst in self.function.blocks[label]:
            if inst.op == Op.FunctionCall:
                nodes.append(self._callee(inst))
            elif inst.op not in CONTROL_FLOW:
                nodes.append(InstructionNode(inst, self.call))
        return nodes

    def _callee(self, inst: Instruction) -> CallNode:
        """The tree of a FunctionCall."""
        callee = self.module.functions[inst.args[0]]
        node = Structurer(self.module, callee, [self.call.key(a) for a in inst.args[1:]], self.types).tree()
        if node.result is not None:
            self.call.own[inst.id] = node.result
        return node

    def _terminator(self, label: int, merge: Instruction | None, stop: int | None, nodes: list[Node]) -> int | None:
        """Appends the nodes for the end of a block. Returns the label of the block that follows; None at the end of the
        region."""
        last = self.function.blocks[label][-1]
        if last.op == Op.Branch:
            target = last.args[0]
            nodes += self._phis(target, label)
            return self._follow(self._jump(target, stop), target, nodes)
        if last.op == Op.Unreachable:
            return None
        if last.op == Op.Return:
            nodes.append(ReturnNode(self.call.number))
            return None
        if last.op == Op.ReturnValue:
            nodes.append(ReturnNode(self.call.number, self.call.key(last.args[0]), self.result))
            return None
        if last.op != Op.BranchConditional:
            unknown(self.module.path, last.op.name)
        branch = Conditional(*last.args[:3])
        if merge is not None and merge.op == Op.SelectionMerge:
            return self._selection(label, branch, merge.args[0], nodes)
        return self._loop_exit(branch, stop, nodes)

    @staticmethod
    def _follow(jump: Jump, target: int, nodes: list[Node]) -> int | None:
        if isinstance(jump, LeaveNode):
            nodes.append(jump)
        return target if jump is None else None

    def _selection(self, label: int, branch: Conditional, end: int, nodes: list[Node]) -> int:
        """A branch whose two ways meet at the block `end`."""
        known = self.module.constant(branch.condition)
        if end in (branch.yes, branch.no):
            nodes += self._phis(end, label)
        node = IfNode(self.call.key(branch.condition), [], [])
        if branch.yes != end and known in (None, True):
            node.then = self._way(branch.yes, end)
        if branch.no != end and known in (None, False):
            node.other = self._way(branch.no, end)
        nodes.append(node)
        return end

    def _way(self, target: int, end: int) -> list[Node]:
        jump = self._jump(target, end)
        return [jump] if isinstance(jump, LeaveNode) else self._region(target, end)

    def _loop_exit(self, branch: Conditional, stop: int | None, nodes: list[Node]) -> int | None:
        """A branch without a merge block: one way leaves a loop."""
        yes, no = self._jump(branch.yes, stop), self._jump(branch.no, stop)
        condition = self.call.key(branch.condition)
        if isinstance(no, LeaveNode):
            nodes.append(IfNode(condition, [], [no]))
            return self._follow(yes, branch.yes, nodes)
        if isinstance(yes, LeaveNode):
            nodes.append(IfNode(condition, [yes], []))
            return self._follow(no, branch.no, nodes)
        return fail(f"{self.module.path}: a branch without a merge block leaves no loop")

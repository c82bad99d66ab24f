"""Reads a SPIR-V binary into instructions by id."""
import struct
import sys
from typing import Callable, NoReturn

from spirv_names import IGNORED, MAGIC, WITHOUT_RESULT, WITHOUT_TYPE, Decoration, ExecutionMode, Op

HEADER_WORDS = 5
NO_ID = 0  # SPIR-V ids start at 1

Constant = bool | int | float

OPS = frozenset(map(int, Op))
DECORATIONS = frozenset(map(int, Decoration))

# Operations on constants, by their operands.
CONSTANT_OPERATIONS: dict[Op, Callable[..., Constant]] = {
    Op.IMul: lambda a, b: a * b,
    Op.IAdd: lambda a, b: a + b,
    Op.ISub: lambda a, b: a - b,
    Op.UDiv: lambda a, b: a // b,
    Op.LogicalNot: lambda a: not a,
    Op.LogicalAnd: lambda a, b: a and b,
    Op.LogicalOr: lambda a, b: a or b,
    Op.INotEqual: lambda a, b: a != b,
    Op.IEqual: lambda a, b: a == b,
    Op.ULessThan: lambda a, b: a < b,
    Op.Select: lambda condition, a, b: a if condition else b,
}


def fail(text: str) -> NoReturn:
    sys.exit(f"translate_spirv.py: {text}")


def unknown(path: str, what: str) -> NoReturn:
    fail(f"{path}: {what} is not supported; add its C++ in engine/gpu/lanes, or remove the kernel from lane_variants "
         "in kernel_variants.cmake")


class Instruction:
    """One instruction. `type` and `id` are NO_ID if it has none; `args` are the remaining words."""

    __slots__ = ("op", "type", "id", "args")

    def __init__(self, op: Op, type_: int, id_: int, args: list[int]) -> None:
        self.op, self.type, self.id, self.args = op, type_, id_, args


class Function:
    """A function as basic blocks by label. `ids` are the results of its parameters and instructions."""

    def __init__(self, inst: Instruction) -> None:
        self.inst = inst
        self.params: list[Instruction] = []
        self.blocks: dict[int, list[Instruction]] = {}
        self.first = NO_ID  # label of the entry block
        self.ids: set[int] = set()

    def add(self, inst: Instruction) -> None:
        if inst.op == Op.FunctionParameter:
            self.params.append(inst)
            self.ids.add(inst.id)
        elif inst.op == Op.Label:
            self.blocks[inst.id] = []
            self.first = self.first or inst.id
        else:
            block = next(reversed(self.blocks.values()))
            block.append(inst)
            if inst.id != NO_ID:
                self.ids.add(inst.id)
            if inst.op == Op.Variable and len(inst.args) > 1:  # a variable with an initial value
                block.append(Instruction(Op.Store, NO_ID, NO_ID, [inst.id, inst.args.pop()]))


class Module:
    """A SPIR-V module. `constants` are the values of the specialisation constants, by SpecId."""

    def __init__(self, path: str, constants: list[int]) -> None:
        self.path = path
        self.ids: dict[int, Instruction] = {}
        self.decorations: dict[int, dict[Decoration, list[int]]] = {}
        self.member_offsets: dict[tuple[int, int], int] = {}  # by (struct, member)
        self.matrix_strides: dict[tuple[int, int], int] = {}  # by (struct, member)
        self.functions: dict[int, Function] = {}
        self.globals: list[Instruction] = []
        self.specialised: dict[int, int] = {}  # values of specialisation constants, by id
        self.entry = NO_ID
        self.local_size = 64  # invocations of a workgroup
        self._function: Function | None = None
        for inst in self._instructions():
            self._add(inst)
        for id_, decorations in self.decorations.items():
            if Decoration.SpecId in decorations:
                index = decorations[Decoration.SpecId][0]
                self.specialised[id_] = constants[index] if index < len(constants) else 0

    def _instructions(self) -> list[Instruction]:
        with open(self.path, "rb") as f:
            data = f.read()
        words = struct.unpack(f"<{len(data) // 4}I", data)
        if words[0] != MAGIC:
            fail(f"{self.path}: not SPIR-V")
        found, at = [], HEADER_WORDS
        while at < len(words):
            count, number = words[at] >> 16, words[at] & 0xffff
            args = list(words[at + 1:at + count])
            at += count
            if number not in OPS:
                unknown(self.path, f"instruction {number}")
            op = Op(number)
            if op in IGNORED:
                continue
            has_result = op not in WITHOUT_RESULT
            type_ = args.pop(0) if has_result and op not in WITHOUT_TYPE else NO_ID
            id_ = args.pop(0) if has_result else NO_ID
            found.append(Instruction(op, type_, id_, args))
        return found

    def _add(self, inst: Instruction) -> None:
        op, args = inst.op, inst.args
        if op == Op.EntryPoint:
            self.entry = args[1]
        elif op == Op.ExecutionMode:
            if args[1] == ExecutionMode.LocalSize:
                self.local_size = args[2]
        elif op == Op.Decorate:
            if args[1] in DECORATIONS:
                self.decorations.setdefault(args[0], {})[Decoration(args[1])] = args[2:]
        elif op == Op.MemberDecorate:
            if args[2] == Decoration.Offset:
                self.member_offsets[args[0], args[1]] = args[3]
            elif args[2] == Decoration.MatrixStride:
                self.matrix_strides[args[0], args[1]] = args[3]
        elif op == Op.Function:
            self._function = self.functions[inst.id] = Function(inst)
        elif op == Op.FunctionEnd:
            self._function = None
        else:
            if inst.id != NO_ID:
                self.ids[inst.id] = inst
            if self._function is not None:
                self._function.add(inst)
            elif op == Op.Variable:
                self.globals.append(inst)

    def constant(self, id_: int) -> Constant | None:
        """Value of a scalar constant; None if `id_` is something else."""
        inst = self.ids.get(id_)
        if inst is None:
            return None
        if inst.op == Op.ConstantTrue:
            return True
        if inst.op == Op.ConstantFalse:
            return False
        if inst.op in (Op.SpecConstantTrue, Op.SpecConstantFalse):
            return bool(self.specialised[id_])
        if inst.op in (Op.Constant, Op.SpecConstant):
            return self._number(inst)
        if inst.op == Op.SpecConstantOp:
            return self._folded(inst)
        return None

    def _number(self, inst: Instruction) -> int | float:
        word = self.specialised[inst.id] if inst.op == Op.SpecConstant else inst.args[0]
        type_ = self.ids[inst.type]
        if type_.op == Op.TypeFloat:
            return struct.unpack("<f", struct.pack("<I", word))[0]
        is_signed = type_.args[1]
        return word - (1 << 32) if is_signed and word >= 1 << 31 else word

    def _folded(self, inst: Instruction) -> Constant:
        number = inst.args[0]
        if number not in OPS or Op(number) not in CONSTANT_OPERATIONS:
            unknown(self.path, f"constant operation {Op(number).name if number in OPS else number}")
        return CONSTANT_OPERATIONS[Op(number)](*(self.constant(operand) for operand in inst.args[1:]))

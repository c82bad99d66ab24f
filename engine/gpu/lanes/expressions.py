"""The C++ of instructions without side effects, scalar by scalar (parts.py)."""
from __future__ import annotations

from typing import Any, Callable

from parts import Flags, Leaf, Texts, Tree, Types, as_lanes, each, first, vary
from spirv import Instruction, unknown
from spirv_names import CONVERSIONS, QUOTIENTS, REMAINDERS, Glsl, Op

BINARY = {
    Op.IAdd: "+", Op.FAdd: "+", Op.ISub: "-", Op.FSub: "-", Op.IMul: "*", Op.FMul: "*", Op.FDiv: "/",
    Op.BitwiseOr: "|", Op.BitwiseXor: "^", Op.BitwiseAnd: "&", Op.LogicalOr: "|", Op.LogicalAnd: "&"}
COMPARE = {
    Op.IEqual: "==", Op.INotEqual: "!=", Op.UGreaterThan: ">", Op.SGreaterThan: ">", Op.UGreaterThanEqual: ">=",
    Op.SGreaterThanEqual: ">=", Op.ULessThan: "<", Op.SLessThan: "<", Op.ULessThanEqual: "<=",
    Op.SLessThanEqual: "<=", Op.FOrdEqual: "==", Op.FUnordNotEqual: "!=", Op.FOrdNotEqual: "!=", Op.FOrdLessThan: "<",
    Op.FOrdGreaterThan: ">", Op.FOrdLessThanEqual: "<=", Op.FOrdGreaterThanEqual: ">="}
# Operations on each scalar of the operands, by the C++ expressions of those.
ELEMENTWISE: dict[Op, Callable[..., str]] = {
    Op.LogicalNot: lambda a: f"not_({a})",
    Op.LogicalEqual: lambda a, b: f"not_({a} ^ {b})",
    Op.LogicalNotEqual: lambda a, b: f"({a} ^ {b})",
    Op.FNegate: lambda a: f"(-{a})",
    Op.SNegate: lambda a: f"(-{a})",
    Op.Not: lambda a: f"(~{a})",
    Op.ShiftLeftLogical: lambda a, b: f"shift_left({a}, {b})",
    Op.ShiftRightLogical: lambda a, b: f"shift_right({a}, {b})",
    Op.ShiftRightArithmetic: lambda a, b: f"shift_right({a}, {b})",
}
PRODUCTS = frozenset({Op.MatrixTimesVector, Op.OuterProduct, Op.Dot, Op.Any, Op.All, Op.VectorExtractDynamic})
# Functions of lanes.h.
FUNCTIONS = {
    Glsl.FAbs: "fabs_", Glsl.FSign: "fsign_", Glsl.Floor: "floor_", Glsl.Ceil: "ceil_", Glsl.Exp: "exp_",
    Glsl.Sqrt: "sqrt_", Glsl.FMin: "fmin_", Glsl.UMin: "umin_", Glsl.SMin: "smin_", Glsl.FMax: "fmax_",
    Glsl.UMax: "umax_", Glsl.SMax: "smax_", Glsl.FClamp: "fclamp_", Glsl.UClamp: "uclamp_", Glsl.SClamp: "sclamp_",
    Glsl.FindILsb: "find_lsb_"}
# Operations on integers that can be computed during translation. None: division by zero.
INTEGERS: dict[Op, Callable[[int, int], "int | None"]] = {
    Op.IAdd: lambda a, b: a + b,
    Op.ISub: lambda a, b: a - b,
    Op.IMul: lambda a, b: a * b,
    Op.UDiv: lambda a, b: a // b if b else None,
    Op.UMod: lambda a, b: a % b if b else None,
    Op.ShiftRightLogical: lambda a, b: a >> b,
    Op.ShiftLeftLogical: lambda a, b: a << b,
    Op.BitwiseAnd: lambda a, b: a & b,
    Op.BitwiseOr: lambda a, b: a | b,
    Op.ULessThan: lambda a, b: a < b,
    Op.SLessThan: lambda a, b: a < b,
    Op.IEqual: lambda a, b: a == b,
    Op.INotEqual: lambda a, b: a != b,
    Op.UGreaterThan: lambda a, b: a > b,
    Op.SGreaterThan: lambda a, b: a > b,
    Op.UGreaterThanEqual: lambda a, b: a >= b,
    Op.ULessThanEqual: lambda a, b: a <= b,
}


def fold(op: Op, values: list[int | None], is_unsigned: bool) -> int | None:
    """Result of an operation on integers that are known during translation; None if it is not known."""
    known = [v for v in values if v is not None]
    if op not in INTEGERS or len(known) < len(values) or any(v < 0 for v in known):
        return None
    value = INTEGERS[op](*known)
    return value & 0xffffffff if is_unsigned and value is not None and not isinstance(value, bool) else value


def choose(condition: Leaf, a: Leaf, b: Leaf, varying: bool) -> str:
    """a if the condition holds, else b."""
    if not condition.varying:
        return f"({condition.text} ? {as_lanes(a, varying)} : {as_lanes(b, varying)})"
    return f"select({condition.text}, {vary(a)}, {vary(b)})"


def pick(parts: list[Leaf], index: Leaf, varying: bool) -> str:
    """The scalar of a list that an index selects at run time; the first one if the index is out of range."""
    text = as_lanes(parts[0], varying)
    for i, part in enumerate(parts[1:], 1):
        if index.varying:
            text = f"select(vm{{(vi)(as_u({index.text}) == {i}u)}}, {vary(part)}, {text})"
        else:
            text = f"(std::uint32_t({index.text}) == {i}u ? {as_lanes(part, varying)} : {text})"
    return text


class Expressions:
    """The C++ of operations, as trees of expressions with the shape of the result.

    args: trees of the operands, None for operands that are plain numbers. wanted: for each scalar of the result,
    whether it is a vector over the lanes."""

    def __init__(self, types: Types) -> None:
        self.types, self.path = types, types.module.path

    def of(self, inst: Instruction, args: list[Any], wanted: Any, is_divisor_uniform: bool) -> Texts:
        """The expressions of an instruction. is_divisor_uniform: see _quotient()."""
        op = inst.op
        if op == Op.ExtInst:
            return self._function(inst.args[1], args[2:], wanted)
        if op in BINARY:
            return self._elements(lambda a, b: f"({a} {BINARY[op]} {b})", wanted, args)
        if op in QUOTIENTS or op in REMAINDERS:
            return self._quotient("div_" if op in QUOTIENTS else "mod_", args, wanted, is_divisor_uniform)
        if op in COMPARE:
            return each(lambda w, a, b: self._comparison(COMPARE[op], w, a, b), wanted, *args)
        if op in ELEMENTWISE:
            return self._elements(ELEMENTWISE[op], wanted, args)
        if op == Op.Select:
            return self._select(args, wanted)
        if op in CONVERSIONS or op == Op.Bitcast:
            return self._conversion(inst, args[0], wanted)
        if op in (Op.VectorTimesScalar, Op.MatrixTimesScalar):
            return each(lambda w, a: f"({as_lanes(a, w)} * {as_lanes(args[1], w)})", wanted, args[0])
        if op in PRODUCTS:
            return self._product(op, args, wanted)
        return unknown(self.path, op.name)

    @staticmethod
    def _elements(f: Callable[..., str], wanted: Flags, args: list[Tree]) -> Texts:
        return each(lambda w, *leaves: f(*(as_lanes(x, w) for x in leaves)), wanted, *args)

    @staticmethod
    def _comparison(sign: str, varying: bool, a: Leaf, b: Leaf) -> str:
        if varying:
            return f"vm{{(vi)({vary(a)} {sign} {vary(b)})}}"
        return f"({first(a)} {sign} {first(b)})"

    @staticmethod
    def _select(args: list[Tree], wanted: Flags) -> Texts:
        condition, a, b = args
        if isinstance(condition, Leaf):
            return each(lambda w, x, y: choose(condition, x, y, w), wanted, a, b)
        return each(lambda w, x, y, c: choose(c, x, y, w), wanted, a, b, condition)

    def _function(self, number: int, args: list[Any], wanted: Flags) -> Texts:
        """An instruction of GLSL.std.450."""
        if number == Glsl.Normalize:
            a = args[0]
            varying = any(x.varying for x in a)
            scale = f"(1.0f / sqrt_({self._dot(a, a, varying)}))"
            return [f"({as_lanes(x, varying)} * {scale})" for x in a]
        if number not in FUNCTIONS:
            unknown(self.path, f"function {number} of GLSL.std.450")
        return self._elements(lambda *texts: f"{FUNCTIONS[Glsl(number)]}({', '.join(texts)})", wanted, args)

    @staticmethod
    def _quotient(function: str, args: list[Any], wanted: Flags, is_divisor_uniform: bool) -> Texts:
        """A division or remainder. A divisor that is the same for all lanes stays a scalar, because it may be a power
        of two."""
        if wanted is True and is_divisor_uniform:
            return f"{function}({vary(args[0])}, {first(args[1])})"
        return Expressions._elements(lambda a, b: f"{function}({a}, {b})", wanted, args)

    def _conversion(self, inst: Instruction, value: Tree, wanted: Flags) -> Texts:
        if inst.op == Op.Bitcast and self.types.of(inst.type).op == Op.TypePointer:
            assert isinstance(value, Leaf)
            return value.text
        type_ = inst.type if self.types.is_scalar(inst.type) else self.types.parts(inst.type)[0]
        function = "bits" if inst.op == Op.Bitcast else "convert"
        return each(lambda w, a: f"{function}<{self.types.scalar(type_, w)}>({as_lanes(a, w)})", wanted, value)

    @staticmethod
    def _dot(a: list[Leaf], b: list[Leaf], varying: bool) -> str:
        terms = [f"{as_lanes(x, varying)} * {as_lanes(y, varying)}" for x, y in zip(a, b)]
        if len(terms) == 4:
            return f"(({terms[0]} + {terms[1]}) + ({terms[2]} + {terms[3]}))"
        return "(" + " + ".join(terms) + ")"

    def _product(self, op: Op, args: list[Any], wanted: Any) -> Texts:
        a = args[0]
        if op == Op.Dot:
            return self._dot(a, args[1], wanted)
        if op in (Op.Any, Op.All):
            sign = " | " if op == Op.Any else " & "
            return "(" + sign.join(as_lanes(x, wanted) for x in a) + ")"
        if op == Op.MatrixTimesVector:
            rows = [[column[i] for column in a] for i in range(len(a[0]))]
            return [self._dot(row, args[1], w) for row, w in zip(rows, wanted)]
        if op == Op.OuterProduct:
            return [[f"({as_lanes(x, w)} * {as_lanes(y, w)})" for x, w in zip(a, column)]
                    for y, column in zip(args[1], wanted)]
        return pick(a, args[1], wanted)  # VectorExtractDynamic

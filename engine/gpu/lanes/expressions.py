"""What an instruction without side effects is in C++, scalar by scalar (parts.py)."""
from parts import Leaf, as_lanes, each, first, vary
from spirv import BINARY, COMPARE, unknown

EXT = {4: "fabs_", 6: "fsign_", 8: "floor_", 9: "ceil_", 27: "exp_", 31: "sqrt_", 37: "fmin_", 38: "umin_", 39: "smin_", 40: "fmax_",
       41: "umax_", 42: "smax_", 43: "fclamp_", 44: "uclamp_", 45: "sclamp_", 73: "find_lsb_"}
NORMALIZE = 69
CONVERSIONS = ("ConvertFToU", "ConvertFToS", "ConvertSToF", "ConvertUToF")
INTEGERS = {"IAdd": lambda a, b: a + b, "ISub": lambda a, b: a - b, "IMul": lambda a, b: a * b, "UDiv": lambda a, b: a // b if b else None,
            "UMod": lambda a, b: a % b if b else None, "ShiftRightLogical": lambda a, b: a >> b, "ShiftLeftLogical": lambda a, b: a << b,
            "BitwiseAnd": lambda a, b: a & b, "BitwiseOr": lambda a, b: a | b, "ULessThan": lambda a, b: a < b, "SLessThan": lambda a, b: a < b,
            "IEqual": lambda a, b: a == b, "INotEqual": lambda a, b: a != b, "UGreaterThan": lambda a, b: a > b, "SGreaterThan": lambda a, b: a > b,
            "UGreaterThanEqual": lambda a, b: a >= b, "ULessThanEqual": lambda a, b: a <= b}


def fold(op, values, word):
    """Value of an operation on numbers that are known; None: not known. word: whether it is an unsigned word."""
    if op == "Bitcast" or op not in INTEGERS or any(v is None for v in values) or any(v < 0 for v in values):
        return None
    value = INTEGERS[op](*values)
    return value & 0xffffffff if word and value is not None and not isinstance(value, bool) else value


def choose(condition, a, b, varying):
    """a where the condition holds, else b."""
    if not condition.varying:
        return f"({condition.text} ? {as_lanes(a, varying)} : {as_lanes(b, varying)})"
    return f"select({condition.text}, {vary(a)}, {vary(b)})"


class Expressions:
    """The C++ of operations. kinds: parts.Types."""

    def __init__(self, kinds):
        self.kinds, self.m = kinds, kinds.m

    def of(self, inst, args, wanted, divisor_known):
        """Tree of C++ texts with the result's shape. args: trees of the operands (None where it is a number); wanted: tree of whether each scalar of the
        result is held over the lanes; divisor_known: see quotient()."""
        op = inst.op
        if op == "ExtInst":
            return self.function(inst.args[1], args[2:], wanted)
        if op in BINARY:
            return self.elements(lambda a, b: f"({a} {BINARY[op]} {b})", wanted, args)
        if op in ("UDiv", "SDiv", "UMod", "SRem"):
            return self.quotient("div_" if op in ("UDiv", "SDiv") else "mod_", args, wanted, divisor_known)
        if op in COMPARE:
            return each(lambda w, a, b: f"vm{{(vi)({vary(a)} {COMPARE[op]} {vary(b)})}}" if w else f"({first(a)} {COMPARE[op]} {first(b)})", wanted, *args)
        if op == "LogicalNot":
            return self.elements(lambda a: f"not_({a})", wanted, args)
        if op == "LogicalEqual":
            return self.elements(lambda a, b: f"not_({a} ^ {b})", wanted, args)
        if op == "LogicalNotEqual":
            return self.elements(lambda a, b: f"({a} ^ {b})", wanted, args)
        if op in ("FNegate", "SNegate", "Not"):
            sign = "~" if op == "Not" else "-"
            return self.elements(lambda a: f"({sign}{a})", wanted, args)
        if op in ("ShiftLeftLogical", "ShiftRightLogical", "ShiftRightArithmetic"):
            function = "shift_left" if op == "ShiftLeftLogical" else "shift_right"
            return self.elements(lambda a, b: f"{function}({a}, {b})", wanted, args)
        if op == "Select":
            condition = args[0]
            return each(lambda w, a, b, *c: choose(c[0] if c else condition, a, b, w), wanted, args[1], args[2], *([] if isinstance(condition, Leaf) else [condition]))
        if op in CONVERSIONS or op == "Bitcast":
            return self.conversion(inst, args, wanted)
        if op in ("VectorTimesScalar", "MatrixTimesScalar"):
            return each(lambda w, a: f"({as_lanes(a, w)} * {as_lanes(args[1], w)})", wanted, args[0])
        if op in ("MatrixTimesVector", "OuterProduct", "Dot", "Any", "All", "VectorExtractDynamic"):
            return self.product(op, args, wanted)
        return unknown(self.m.path, op)

    @staticmethod
    def elements(f, wanted, args):
        return each(lambda w, *leaves: f(*(as_lanes(x, w) for x in leaves)), wanted, *args)

    def function(self, number, args, wanted):
        if number == NORMALIZE:
            a = args[0]
            all_lanes = any(x.varying for x in a)
            length = f"(1.0f / sqrt_({self.dot(a, a, all_lanes)}))"
            return [f"({as_lanes(x, all_lanes)} * {length})" for x in a]
        if number not in EXT:
            unknown(self.m.path, f"function {number} of GLSL.std.450")
        return self.elements(lambda *texts: f"{EXT[number]}({', '.join(texts)})", wanted, args)

    @staticmethod
    def quotient(function, args, wanted, divisor_known):
        """By a number that all lanes have in common where it is one: such a one may be a power of two."""
        if wanted is True and divisor_known:
            return f"{function}({vary(args[0])}, {first(args[1])})"
        return Expressions.elements(lambda a, b: f"{function}({a}, {b})", wanted, args)

    def conversion(self, inst, args, wanted):
        if inst.op == "Bitcast" and self.kinds.of(inst.type).op == "TypePointer":
            return args[0].text
        type_ = inst.type if self.kinds.is_scalar(inst.type) else self.kinds.parts(inst.type)[0]
        function = "bits" if inst.op == "Bitcast" else "convert"
        return each(lambda w, a: f"{function}<{self.kinds.scalar(type_, w)}>({as_lanes(a, w)})", wanted, args[0])

    @staticmethod
    def dot(a, b, varying):
        terms = [f"{as_lanes(x, varying)} * {as_lanes(y, varying)}" for x, y in zip(a, b)]
        if len(terms) == 4:
            return f"(({terms[0]} + {terms[1]}) + ({terms[2]} + {terms[3]}))"
        return "(" + " + ".join(terms) + ")"

    def product(self, op, args, wanted):
        if op == "Dot":
            return self.dot(args[0], args[1], wanted)
        if op in ("Any", "All"):
            sign = " | " if op == "Any" else " & "
            return "(" + sign.join(as_lanes(x, wanted) for x in args[0]) + ")"
        if op == "MatrixTimesVector":
            rows = [[column[i] for column in args[0]] for i in range(len(args[0][0]))]
            return [self.dot(row, args[1], w) for row, w in zip(rows, wanted)]
        if op == "OuterProduct":
            return [[f"({as_lanes(x, w)} * {as_lanes(y, w)})" for x, w in zip(args[0], column)] for y, column in zip(args[1], wanted)]
        index = args[1]
        return pick(args[0], index, wanted)


def pick(parts, index, varying):
    """Text of the scalar of a list that an index names while the kernel runs; the first for what names none."""
    text = as_lanes(parts[0], varying)
    for i, part in enumerate(parts[1:], 1):
        if index.varying:
            text = f"select(vm{{(vi)(as_u({index.text}) == {i}u)}}, {vary(part)}, {text})"
        else:
            text = f"(std::uint32_t({index.text}) == {i}u ? {as_lanes(part, varying)} : {text})"
    return text


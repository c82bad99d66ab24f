"""A SPIR-V binary as instructions by number. Names and numbers are those of the SPIR-V specification."""
import struct
import sys

OPS = {  # number: (name, has a result type, has a result)
    1: ("Undef", 1, 1), 11: ("ExtInstImport", 0, 1), 12: ("ExtInst", 1, 1), 15: ("EntryPoint", 0, 0), 16: ("ExecutionMode", 0, 0),
    19: ("TypeVoid", 0, 1), 20: ("TypeBool", 0, 1), 21: ("TypeInt", 0, 1), 22: ("TypeFloat", 0, 1), 23: ("TypeVector", 0, 1),
    24: ("TypeMatrix", 0, 1), 28: ("TypeArray", 0, 1), 29: ("TypeRuntimeArray", 0, 1), 30: ("TypeStruct", 0, 1),
    32: ("TypePointer", 0, 1), 33: ("TypeFunction", 0, 1), 39: ("TypeForwardPointer", 0, 0), 41: ("ConstantTrue", 1, 1),
    42: ("ConstantFalse", 1, 1), 43: ("Constant", 1, 1), 44: ("ConstantComposite", 1, 1), 46: ("ConstantNull", 1, 1),
    48: ("SpecConstantTrue", 1, 1), 49: ("SpecConstantFalse", 1, 1), 50: ("SpecConstant", 1, 1), 51: ("SpecConstantComposite", 1, 1),
    52: ("SpecConstantOp", 1, 1), 54: ("Function", 1, 1), 55: ("FunctionParameter", 1, 1), 56: ("FunctionEnd", 0, 0),
    57: ("FunctionCall", 1, 1), 59: ("Variable", 1, 1), 61: ("Load", 1, 1), 62: ("Store", 0, 0), 65: ("AccessChain", 1, 1),
    66: ("InBoundsAccessChain", 1, 1), 71: ("Decorate", 0, 0), 72: ("MemberDecorate", 0, 0), 77: ("VectorExtractDynamic", 1, 1),
    79: ("VectorShuffle", 1, 1), 80: ("CompositeConstruct", 1, 1), 81: ("CompositeExtract", 1, 1), 82: ("CompositeInsert", 1, 1),
    83: ("CopyObject", 1, 1), 109: ("ConvertFToU", 1, 1), 110: ("ConvertFToS", 1, 1), 111: ("ConvertSToF", 1, 1),
    112: ("ConvertUToF", 1, 1), 124: ("Bitcast", 1, 1), 126: ("SNegate", 1, 1), 127: ("FNegate", 1, 1), 128: ("IAdd", 1, 1),
    129: ("FAdd", 1, 1), 130: ("ISub", 1, 1), 131: ("FSub", 1, 1), 132: ("IMul", 1, 1), 133: ("FMul", 1, 1), 134: ("UDiv", 1, 1),
    135: ("SDiv", 1, 1), 136: ("FDiv", 1, 1), 137: ("UMod", 1, 1), 138: ("SRem", 1, 1), 139: ("SMod", 1, 1), 142: ("VectorTimesScalar", 1, 1),
    143: ("MatrixTimesScalar", 1, 1), 144: ("VectorTimesMatrix", 1, 1), 145: ("MatrixTimesVector", 1, 1), 147: ("OuterProduct", 1, 1),
    148: ("Dot", 1, 1), 154: ("Any", 1, 1), 155: ("All", 1, 1), 164: ("LogicalEqual", 1, 1), 165: ("LogicalNotEqual", 1, 1),
    166: ("LogicalOr", 1, 1), 167: ("LogicalAnd", 1, 1), 168: ("LogicalNot", 1, 1), 169: ("Select", 1, 1), 170: ("IEqual", 1, 1),
    171: ("INotEqual", 1, 1), 172: ("UGreaterThan", 1, 1), 173: ("SGreaterThan", 1, 1), 174: ("UGreaterThanEqual", 1, 1),
    175: ("SGreaterThanEqual", 1, 1), 176: ("ULessThan", 1, 1), 177: ("SLessThan", 1, 1), 178: ("ULessThanEqual", 1, 1),
    179: ("SLessThanEqual", 1, 1), 180: ("FOrdEqual", 1, 1), 183: ("FUnordNotEqual", 1, 1), 182: ("FOrdNotEqual", 1, 1),
    184: ("FOrdLessThan", 1, 1), 186: ("FOrdGreaterThan", 1, 1), 188: ("FOrdLessThanEqual", 1, 1), 190: ("FOrdGreaterThanEqual", 1, 1),
    194: ("ShiftRightLogical", 1, 1), 195: ("ShiftRightArithmetic", 1, 1), 196: ("ShiftLeftLogical", 1, 1), 197: ("BitwiseOr", 1, 1),
    198: ("BitwiseXor", 1, 1), 199: ("BitwiseAnd", 1, 1), 200: ("Not", 1, 1), 224: ("ControlBarrier", 0, 0), 225: ("MemoryBarrier", 0, 0),
    230: ("AtomicCompareExchange", 1, 1),
    234: ("AtomicIAdd", 1, 1), 239: ("AtomicUMax", 1, 1), 241: ("AtomicOr", 1, 1), 245: ("Phi", 1, 1), 246: ("LoopMerge", 0, 0),
    247: ("SelectionMerge", 0, 0), 248: ("Label", 0, 1), 249: ("Branch", 0, 0), 250: ("BranchConditional", 0, 0), 253: ("Return", 0, 0),
    254: ("ReturnValue", 0, 0), 255: ("Unreachable", 0, 0), 400: ("CopyLogical", 1, 1)}
SKIPPED = {3, 4, 5, 6, 7, 8, 10, 14, 17, 330}

# As C++ writes them.
BINARY = {"IAdd": "+", "FAdd": "+", "ISub": "-", "FSub": "-", "IMul": "*", "FMul": "*", "FDiv": "/", "BitwiseOr": "|", "BitwiseXor": "^",
          "BitwiseAnd": "&", "LogicalOr": "|", "LogicalAnd": "&"}
COMPARE = {"IEqual": "==", "INotEqual": "!=", "UGreaterThan": ">", "SGreaterThan": ">", "UGreaterThanEqual": ">=", "SGreaterThanEqual": ">=",
           "ULessThan": "<", "SLessThan": "<", "ULessThanEqual": "<=", "SLessThanEqual": "<=", "FOrdEqual": "==", "FUnordNotEqual": "!=",
           "FOrdNotEqual": "!=", "FOrdLessThan": "<", "FOrdGreaterThan": ">", "FOrdLessThanEqual": "<=", "FOrdGreaterThanEqual": ">="}


def fail(text):
    sys.exit(f"translate_spirv.py: {text}")


def unknown(path, what):
    fail(f"{path}: {what} is not known; teach engine/gpu/lanes what it is in C++, or leave the kernel out of lane_variants (kernel_variants.cmake)")


class Inst:
    __slots__ = ("op", "type", "id", "args")

    def __init__(self, op, type_, id_, args):
        self.op, self.type, self.id, self.args = op, type_, id_, args


class Module:
    """What a SPIR-V binary says, by id."""

    def __init__(self, path, constants):
        with open(path, "rb") as f:
            data = f.read()
        words = struct.unpack(f"<{len(data) // 4}I", data)
        if words[0] != 0x07230203:
            fail(f"{path}: not SPIR-V")
        self.path, self.ids, self.decorations, self.member_offsets, self.functions, self.spec = path, {}, {}, {}, {}, {}
        self.matrix_strides, self.globals, self.local_size = {}, [], 64
        function, at = None, 5
        while at < len(words):
            count, number = words[at] >> 16, words[at] & 0xffff
            args = list(words[at + 1:at + count])
            at += count
            if number in SKIPPED:
                continue
            if number not in OPS:
                unknown(path, f"instruction {number}")
            name, typed, valued = OPS[number]
            type_ = args.pop(0) if typed else None
            id_ = args.pop(0) if valued else None
            inst = Inst(name, type_, id_, args)
            if name == "EntryPoint":
                self.entry = args[1]
            elif name == "ExecutionMode" and args[1] == 17:
                self.local_size = args[2]
            elif name == "Decorate":
                self.decorations.setdefault(args[0], {})[args[1]] = args[2:]
            elif name == "MemberDecorate":
                if args[2] == 35:
                    self.member_offsets[args[0], args[1]] = args[3]
                elif args[2] == 7:
                    self.matrix_strides[args[0], args[1]] = args[3]
            elif name == "Function":
                function = {"inst": inst, "params": [], "blocks": {}, "first": None}
                self.functions[id_] = function
            elif name == "FunctionEnd":
                function = None
            elif function is not None:
                if name == "FunctionParameter":
                    function["params"].append(inst)
                elif name == "Label":
                    block = []
                    function["blocks"][id_] = block
                    function["first"] = function["first"] or id_
                else:
                    block.append(inst)
                    if name == "Variable" and len(args) > 1:  # with a value from the start
                        block.append(Inst("Store", None, None, [id_, args.pop()]))
                if id_ is not None:
                    self.ids[id_] = inst
            else:
                if id_ is not None:
                    self.ids[id_] = inst
                if name == "Variable":
                    self.globals.append(inst)
        for id_, decorations in self.decorations.items():
            if 1 in decorations:
                self.spec[id_] = constants[decorations[1][0]] if decorations[1][0] < len(constants) else 0

    def constant(self, id_):
        """Value of a constant, None if it is none."""
        i = self.ids.get(id_)
        if i is None:
            return None
        if i.op == "ConstantTrue":
            return True
        if i.op == "ConstantFalse":
            return False
        if i.op in ("SpecConstantTrue", "SpecConstantFalse"):
            return bool(self.spec[id_])
        if i.op in ("Constant", "SpecConstant"):
            word = self.spec[id_] if i.op == "SpecConstant" else i.args[0]
            t = self.ids[i.type]
            if t.op == "TypeFloat":
                return struct.unpack("<f", struct.pack("<I", word))[0]
            return word - (1 << 32) if t.args[1] and word >= 1 << 31 else word
        if i.op == "SpecConstantOp":
            op = OPS[i.args[0]][0]
            a = [self.constant(x) for x in i.args[1:]]
            table = {"IMul": lambda: a[0] * a[1], "IAdd": lambda: a[0] + a[1], "ISub": lambda: a[0] - a[1], "UDiv": lambda: a[0] // a[1],
                     "LogicalNot": lambda: not a[0], "LogicalAnd": lambda: a[0] and a[1], "LogicalOr": lambda: a[0] or a[1], "INotEqual": lambda: a[0] != a[1],
                     "IEqual": lambda: a[0] == a[1], "ULessThan": lambda: a[0] < a[1], "Select": lambda: a[1] if a[0] else a[2]}
            if op not in table:
                unknown(self.path, f"constant operation {op}")
            return table[op]()
        return None

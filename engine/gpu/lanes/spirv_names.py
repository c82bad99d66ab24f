"""Numbers of the SPIR-V specification, under its names: those that kernels use."""
from enum import IntEnum

MAGIC = 0x07230203


class Op(IntEnum):
    """Instructions."""

    Undef = 1
    Source = 3
    SourceExtension = 4
    Name = 5
    MemberName = 6
    String = 7
    Line = 8
    Extension = 10
    ExtInstImport = 11
    ExtInst = 12
    MemoryModel = 14
    EntryPoint = 15
    ExecutionMode = 16
    Capability = 17
    TypeVoid = 19
    TypeBool = 20
    TypeInt = 21
    TypeFloat = 22
    TypeVector = 23
    TypeMatrix = 24
    TypeArray = 28
    TypeRuntimeArray = 29
    TypeStruct = 30
    TypePointer = 32
    TypeFunction = 33
    TypeForwardPointer = 39
    ConstantTrue = 41
    ConstantFalse = 42
    Constant = 43
    ConstantComposite = 44
    ConstantNull = 46
    SpecConstantTrue = 48
    SpecConstantFalse = 49
    SpecConstant = 50
    SpecConstantComposite = 51
    SpecConstantOp = 52
    Function = 54
    FunctionParameter = 55
    FunctionEnd = 56
    FunctionCall = 57
    Variable = 59
    Load = 61
    Store = 62
    AccessChain = 65
    InBoundsAccessChain = 66
    Decorate = 71
    MemberDecorate = 72
    VectorExtractDynamic = 77
    VectorShuffle = 79
    CompositeConstruct = 80
    CompositeExtract = 81
    CompositeInsert = 82
    CopyObject = 83
    ConvertFToU = 109
    ConvertFToS = 110
    ConvertSToF = 111
    ConvertUToF = 112
    Bitcast = 124
    SNegate = 126
    FNegate = 127
    IAdd = 128
    FAdd = 129
    ISub = 130
    FSub = 131
    IMul = 132
    FMul = 133
    UDiv = 134
    SDiv = 135
    FDiv = 136
    UMod = 137
    SRem = 138
    SMod = 139
    VectorTimesScalar = 142
    MatrixTimesScalar = 143
    VectorTimesMatrix = 144
    MatrixTimesVector = 145
    OuterProduct = 147
    Dot = 148
    Any = 154
    All = 155
    LogicalEqual = 164
    LogicalNotEqual = 165
    LogicalOr = 166
    LogicalAnd = 167
    LogicalNot = 168
    Select = 169
    IEqual = 170
    INotEqual = 171
    UGreaterThan = 172
    SGreaterThan = 173
    UGreaterThanEqual = 174
    SGreaterThanEqual = 175
    ULessThan = 176
    SLessThan = 177
    ULessThanEqual = 178
    SLessThanEqual = 179
    FOrdEqual = 180
    FOrdNotEqual = 182
    FUnordNotEqual = 183
    FOrdLessThan = 184
    FOrdGreaterThan = 186
    FOrdLessThanEqual = 188
    FOrdGreaterThanEqual = 190
    ShiftRightLogical = 194
    ShiftRightArithmetic = 195
    ShiftLeftLogical = 196
    BitwiseOr = 197
    BitwiseXor = 198
    BitwiseAnd = 199
    Not = 200
    ControlBarrier = 224
    MemoryBarrier = 225
    AtomicCompareExchange = 230
    AtomicIAdd = 234
    AtomicUMax = 239
    AtomicOr = 241
    Phi = 245
    LoopMerge = 246
    SelectionMerge = 247
    Label = 248
    Branch = 249
    BranchConditional = 250
    Return = 253
    ReturnValue = 254
    Unreachable = 255
    ModuleProcessed = 330
    CopyLogical = 400


class Decoration(IntEnum):
    SpecId = 1
    ArrayStride = 6
    MatrixStride = 7
    BuiltIn = 11
    Offset = 35


class StorageClass(IntEnum):
    Input = 1
    Workgroup = 4
    Function = 7
    PushConstant = 9
    PhysicalStorageBuffer = 5349


class BuiltIn(IntEnum):
    NumWorkgroups = 24
    WorkgroupId = 26
    LocalInvocationIndex = 29


class ExecutionMode(IntEnum):
    LocalSize = 17


class LoopControl(IntEnum):
    """Bits of the loop control of LoopMerge."""

    Unroll = 1


class Glsl(IntEnum):
    """Extended instructions of the set GLSL.std.450."""

    FAbs = 4
    FSign = 6
    Floor = 8
    Ceil = 9
    Exp = 27
    Sqrt = 31
    FMin = 37
    UMin = 38
    SMin = 39
    FMax = 40
    UMax = 41
    SMax = 42
    FClamp = 43
    UClamp = 44
    SClamp = 45
    Normalize = 69
    FindILsb = 73


# Debug information and module-wide declarations that do not affect the code.
IGNORED = frozenset({
    Op.Source, Op.SourceExtension, Op.Name, Op.MemberName, Op.String, Op.Line, Op.Extension, Op.MemoryModel,
    Op.Capability, Op.ModuleProcessed})

# Instructions without a result, and instructions with a result but no result type. All others have both.
WITHOUT_RESULT = frozenset({
    Op.EntryPoint, Op.ExecutionMode, Op.TypeForwardPointer, Op.FunctionEnd, Op.Store, Op.Decorate, Op.MemberDecorate,
    Op.ControlBarrier, Op.MemoryBarrier, Op.LoopMerge, Op.SelectionMerge, Op.Branch, Op.BranchConditional, Op.Return,
    Op.ReturnValue, Op.Unreachable})
WITHOUT_TYPE = frozenset({
    Op.ExtInstImport, Op.TypeVoid, Op.TypeBool, Op.TypeInt, Op.TypeFloat, Op.TypeVector, Op.TypeMatrix, Op.TypeArray,
    Op.TypeRuntimeArray, Op.TypeStruct, Op.TypePointer, Op.TypeFunction, Op.Label})

SCALAR_TYPES = frozenset({Op.TypeBool, Op.TypeInt, Op.TypeFloat, Op.TypePointer})
ATOMICS = frozenset({Op.AtomicCompareExchange, Op.AtomicIAdd, Op.AtomicUMax, Op.AtomicOr})
ACCESS_CHAINS = frozenset({Op.AccessChain, Op.InBoundsAccessChain})
CONVERSIONS = frozenset({Op.ConvertFToU, Op.ConvertFToS, Op.ConvertSToF, Op.ConvertUToF})
QUOTIENTS = frozenset({Op.UDiv, Op.SDiv})
REMAINDERS = frozenset({Op.UMod, Op.SRem})

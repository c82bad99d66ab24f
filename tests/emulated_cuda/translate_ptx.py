#!/usr/bin/env python3
"""Translates PTX to C++, so that kernels compiled by nvcc run without a GPU.

usage: translate_ptx.py OUTPUT_PREFIX PARTS FILE.ptx...

Writes OUTPUT_PREFIX_0.cpp, OUTPUT_PREFIX_1.cpp, ... (PARTS files), which machine.h runs: a function for each kernel, a
statement for each instruction. Instructions that the kernels of this project do not use are an error that names the
line. Their meaning is that of NVIDIA's manual "PTX ISA", version 9.0.
"""
from __future__ import annotations

import re
import sys
from typing import NamedTuple, TextIO

BITS = {
    "b8": 8, "u8": 8, "s8": 8, "b16": 16, "u16": 16, "s16": 16, "b32": 32, "u32": 32, "s32": 32, "f32": 32, "b64": 64,
    "u64": 64, "s64": 64}
CPP_OF_REGISTER = {"pred": "bool", "b16": "uint16_t", "b32": "uint32_t", "f32": "float", "b64": "uint64_t"}
SPECIAL_REGISTERS = {
    "%tid.x": "machine.thread()", "%ctaid.x": "machine.group()", "%ntid.x": "machine.threads()",
    "%nctaid.x": "machine.groups()"}
COMPARISONS = {
    "eq": "==", "ne": "!=", "lt": "<", "le": "<=", "gt": ">", "ge": ">=", "lo": "<", "ls": "<=", "hi": ">", "hs": ">="}
UNORDERED_COMPARISONS = {"equ": "==", "neu": "!=", "ltu": "<", "leu": "<=", "gtu": ">", "geu": ">="}  # true for NaN
SIGNS = {"add": "+", "sub": "-", "and": "&", "or": "|", "xor": "^"}
ROUNDINGS = {"rmi": "floor", "rpi": "ceil", "rzi": "trunc", "rni": "nearbyint"}

# The C++ of instructions whose operands all have the type at the end of the name.
EXPRESSIONS = {
    "add.rn.f32": "{1} + {2}",
    "add.f32": "{1} + {2}",
    "sub.rn.f32": "{1} - {2}",
    "sub.f32": "{1} - {2}",
    "mul.rn.f32": "{1} * {2}",
    "mul.f32": "{1} * {2}",
    "div.rn.f32": "{1} / {2}",
    "fma.rn.f32": "std::fma({1}, {2}, {3})",
    "fma.rm.f32": "fma_down({1}, {2}, {3})",
    "rcp.rn.f32": "1.0f / {1}",
    "sqrt.rn.f32": "std::sqrt({1})",
    "ex2.approx.ftz.f32": "exp2_flushed({1})",
    "abs.f32": "std::fabs({1})",
    "neg.f32": "-{1}",
    "min.f32": "min_number({1}, {2})",
    "max.f32": "max_number({1}, {2})",
    "min.s32": "std::min({1}, {2})",
    "max.s32": "std::max({1}, {2})",
    "min.u32": "std::min({1}, {2})",
    "max.u32": "std::max({1}, {2})",
    "div.u32": "divide({1}, {2})",
    "rem.u32": "remainder({1}, {2})",
    "bfi.b32": "insert_bits({1}, {2}, {3}, {4})",
    "brev.b32": "reverse_bits({1})",
    "bfind.shiftamt.u32": "shift_of_first_bit({1})",
}
# Instructions with a method of their own, by the first word of the opcode (Kernel._computed).
COMPUTED = ("add", "sub", "and", "or", "xor", "not", "neg", "mul", "mad", "shl", "shr", "selp", "setp", "cvt")

SPACES = ("param", "global", "shared", "local")
ORDERING_WORDS = ("nc", "volatile", "relaxed", "gpu", "cta", "sys")
# Classes of instructions by the unit of a GPU that runs them, as in machine.h.
CLASSES = ("multiply_add", "special", "other", "shared", "global", "local", "atomic")
REGISTERS_PER_LINE = 16


class Unknown(Exception):
    """An instruction or declaration that is not supported."""


class Parameter(NamedTuple):
    """Place of a kernel's parameter, in bytes."""

    offset: int
    size: int


def instruction_class(opcode: str) -> str | None:
    """The class of an instruction; None if ptxas makes no instruction of it (moves, addresses, parameters)."""
    words = opcode.split(".")
    head, suffix = words[0], words[-1]
    if head in ("mov", "cvta") or opcode.startswith("ld.param"):
        return None
    if head in ("ld", "st"):
        return words[1] if words[1] in SPACES else "global"
    if head == "atom":
        return "shared" if words[1] == "shared" else "atomic"
    if suffix == "f32" and head in ("add", "sub", "mul", "fma"):
        return "multiply_add"
    if suffix == "f32" and head in ("div", "rcp", "sqrt", "ex2"):
        return "special"
    return "other"


def cpp_type(suffix: str) -> str:
    """The C++ type of a PTX type such as s32."""
    if suffix == "f32":
        return "float"
    if suffix == "pred":
        return "bool"
    return ("int" if suffix[0] == "s" else "uint") + f"{BITS[suffix]}_t"


def unsigned(suffix: str) -> str:
    return "u" + suffix[1:]


def split_operands(text: str) -> list[str]:
    """Splits at commas outside of braces and brackets."""
    parts, depth, start = [], 0, 0
    for i, c in enumerate(text):
        if c in "{[":
            depth += 1
        elif c in "}]":
            depth -= 1
        elif c == "," and depth == 0:
            parts.append(text[start:i].strip())
            start = i + 1
    parts.append(text[start:].strip())
    return [p for p in parts if p]


def label_of(name: str) -> str:
    return "L_" + name.strip().strip("$").replace("$", "_")


def aligned(offset: int, alignment: int) -> int:
    return (offset + alignment - 1) // alignment * alignment


class Operands:
    """The operands of one instruction. Operand 0 is the result."""

    def __init__(self, kernel: Kernel, texts: list[str], suffix: str) -> None:
        self.kernel, self.texts, self.suffix = kernel, texts, suffix

    def read(self, index: int, suffix: str | None = None) -> str:
        """An operand as C++, with the type at the end of the opcode or another one."""
        return self.kernel.read(self.texts[index], suffix or self.suffix)

    def put(self, expression: str, suffix: str | None = None) -> str:
        """The C++ that sets the result."""
        return self.kernel.write(self.texts[0], suffix or self.suffix, expression)


class Kernel:
    """One kernel: its declarations, and its body as C++."""

    def __init__(self, name: str, number: int, module: Module) -> None:
        self.name, self.number, self.module = name, number, module
        self.parameters: dict[str, Parameter] = {}
        self.parameter_bytes = 0
        self.registers: dict[str, str] = {}  # PTX types by prefix of the names
        self.shared: dict[str, int] = {}  # offsets by name
        self.local: dict[str, int] = {}
        self.shared_bytes = self.local_bytes = 0
        self.barriers = 0
        self.accesses = 0
        self.max_threads = 1024
        self.declarations: list[str] = []
        self.body: list[str] = []
        self.blocks: list[list[int]] = []  # instructions of each class, by basic block
        self._starts_block = True
        self._place = "0"  # file and line in the source, as machine.h encodes them

    # Declarations.

    def add_parameter(self, line: str) -> None:
        match = re.match(r"\.param (?:\.align (\d+) )?\.(\w+) (\S+?)(?:\[(\d+)\])?,?$", line)
        if not match:
            raise Unknown(line)
        size = BITS[match[2]] // 8
        offset = aligned(self.parameter_bytes, max(int(match[1] or 1), size))
        self.parameters[match[3]] = Parameter(offset, size * int(match[4] or 1))
        self.parameter_bytes = offset + size * int(match[4] or 1)

    def _add_memory(self, line: str) -> None:
        match = re.match(r"\.(shared|local) (?:\.align (\d+) )?\.(\w+)\s+(\S+?)(?:\[(\d+)\])?;$", line)
        if not match:
            raise Unknown(line)
        element = BITS[match[3]] // 8
        alignment, size = max(int(match[2] or 1), element), element * int(match[5] or 1)
        if match[1] == "shared":
            self.shared[match[4]] = aligned(self.shared_bytes, alignment)
            self.shared_bytes = self.shared[match[4]] + size
        else:
            self.local[match[4]] = aligned(self.local_bytes, alignment)
            self.local_bytes = self.local[match[4]] + size

    def _add_registers(self, line: str) -> None:
        match = re.match(r"\.reg \.(\w+)\s+(%\w+?)(?:<(\d+)>)?;$", line)
        if not match:
            raise Unknown(line)
        type_, prefix, count = match.groups()
        self.registers[prefix] = type_ if type_ in CPP_OF_REGISTER else "b" + type_[1:]
        names = [f"{prefix}{i}" for i in range(int(count))] if count else [prefix]
        for start in range(0, len(names), REGISTERS_PER_LINE):
            variables = ", ".join("r_" + n[1:] for n in names[start:start + REGISTERS_PER_LINE])
            self.declarations.append(f"{CPP_OF_REGISTER[self.registers[prefix]]} {variables};")

    # Operands.

    def _register_type(self, name: str) -> str | None:
        prefix = name.rstrip("0123456789")
        return self.registers.get(name) or self.registers.get(prefix)

    def _cpp_of(self, register: str) -> str:
        """The C++ type of a register."""
        type_ = self._register_type(register)
        if type_ is None:
            raise Unknown(register)
        return CPP_OF_REGISTER[type_]

    @staticmethod
    def _variable(register: str) -> str:
        return "r_" + register[1:].replace(".", "_")

    def read(self, operand: str, suffix: str) -> str:
        """An operand as C++ of the type that the suffix names."""
        wanted = cpp_type(suffix)
        if operand in SPECIAL_REGISTERS:
            return f"{wanted}({SPECIAL_REGISTERS[operand]})"
        if operand.startswith("%"):
            type_, name = self._cpp_of(operand), self._variable(operand)
            if type_ == wanted:
                return name
            if "float" in (type_, wanted):
                return f"std::bit_cast<{wanted}>({name})"
            return f"static_cast<{wanted}>({name})"
        if re.match(r"0[fF][0-9A-Fa-f]{8}$", operand):
            return f"std::bit_cast<float>(0x{operand[2:]}u)"
        if re.match(r"-?(0x[0-9A-Fa-f]+|\d+)$", operand):
            if suffix == "pred":
                return "true" if int(operand, 0) else "false"
            value = int(operand, 0) & ((1 << BITS[suffix]) - 1)
            return f"static_cast<{wanted}>({value}ull)"
        return f"static_cast<{wanted}>({self._symbol(operand)})"

    def write(self, operand: str, suffix: str, expression: str) -> str:
        """The C++ that sets a register to an expression of the type that the suffix names."""
        type_, name, given = self._cpp_of(operand), self._variable(operand), cpp_type(suffix)
        if type_ == given:
            return f"{name} = {expression};"
        if "float" in (type_, given):
            return f"{name} = std::bit_cast<{type_}>({expression});"
        return f"{name} = static_cast<{type_}>(static_cast<{given}>({expression}));"

    def _symbol(self, name: str) -> str:
        """The address of a parameter or variable."""
        if name in self.parameters:
            return f"machine.parameters({self.parameters[name].offset})"
        if name in self.shared:
            return f"{self.shared[name]}ull"
        if name in self.local:
            return f"(reinterpret_cast<uint64_t>(local) + {self.local[name]})"
        if name in self.module.variables:
            return f"reinterpret_cast<uint64_t>({self.module.variables[name]})"
        raise Unknown(name)

    def _address(self, operand: str) -> str:
        match = re.match(r"\[(\S+?)(?:\+(-?\d+))?\]$", operand)
        if not match:
            raise Unknown(operand)
        base = self.read(match[1], "u64") if match[1].startswith("%") else self._symbol(match[1])
        return f"{base} + static_cast<uint64_t>({match[2]}ll)" if match[2] else base

    # Instructions.

    def _instruction(self, text: str) -> str:
        """The C++ of one instruction without its guard."""
        opcode, _, rest = text.partition(" ")
        words = opcode.split(".")
        head, suffix = words[0], words[-1]
        if head == "bra":
            return f"goto {label_of(rest)};"
        if head == "ret":
            return "return;"
        operands = Operands(self, split_operands(rest.strip()), suffix)
        if head == "mov":
            return operands.put(operands.read(1))
        if head in ("ld", "st"):
            return self._access(head, words[1:], operands.texts)
        if head == "atom":
            return self._atomic(opcode, operands)
        if head in ("bar", "barrier"):
            if words[1:] != ["sync"] or operands.texts != ["0"]:
                raise Unknown(text)
            self.barriers += 1
            return f"machine.barrier({self.barriers}u, {self._place});"
        if head in ("membar", "fence"):
            return ";"
        if head == "cvta":
            return operands.put(operands.read(1, "u64"), "u64")
        if opcode in EXPRESSIONS:
            values = (operands.read(i) for i in range(1, len(operands.texts)))
            return operands.put(EXPRESSIONS[opcode].format("", *values))
        if head not in COMPUTED:
            raise Unknown(text)
        return self._computed(words, operands)

    def _computed(self, words: list[str], operands: Operands) -> str:
        """The C++ of arithmetic on integers and predicates, comparisons and conversions."""
        head, suffix, opcode = words[0], words[-1], ".".join(words)
        read, put = operands.read, operands.put
        if head == "cvt":
            return self._conversion(words[1:-2], words[-2], words[-1], operands)
        if head == "setp":
            return self._comparison(words, operands)
        if head == "selp" and len(words) == 2:
            return put(f"{read(3, 'pred')} ? {read(1)} : {read(2)}")
        if opcode == "neg.s32":
            return put(f"static_cast<uint32_t>(0u - {read(1, 'u32')})", "u32")
        if suffix != "f32" and head in ("mul", "mad"):
            return self._product(words, operands)
        if suffix == "f32" or len(words) != 2:  # an instruction with a modifier, or unknown
            raise Unknown(opcode)
        if head in SIGNS:
            if suffix == "pred":
                return put(f"static_cast<bool>({read(1)} {SIGNS[head]} {read(2)})")
            kind = unsigned(suffix)
            return put(f"static_cast<{cpp_type(kind)}>({read(1, kind)} {SIGNS[head]} {read(2, kind)})", kind)
        if head == "not":
            return put(f"!{read(1)}" if suffix == "pred" else f"static_cast<{cpp_type(suffix)}>(~{read(1)})")
        if head in ("shl", "shr"):
            direction = "left" if head == "shl" else "right"
            return put(f"shift_{direction}({read(1)}, {read(2, 'u32')})")
        raise Unknown(opcode)

    @staticmethod
    def _product(words: list[str], operands: Operands) -> str:
        head, part, suffix = words[0], words[1], words[-1]
        read, put = operands.read, operands.put
        if head == "mul" and part == "wide":
            wide = suffix[0] + str(2 * BITS[suffix])
            return put(f"static_cast<{cpp_type(wide)}>({read(1)}) * static_cast<{cpp_type(wide)}>({read(2)})", wide)
        if part != "lo":
            raise Unknown(".".join(words))
        kind = unsigned(suffix)
        summand = f" + {read(3, kind)}" if head == "mad" else ""
        return put(f"static_cast<{cpp_type(kind)}>(uint64_t{{{read(1, kind)}}} * {read(2, kind)}{summand})", kind)

    @staticmethod
    def _comparison(words: list[str], operands: Operands) -> str:
        if len(words) != 3:
            raise Unknown(".".join(words))
        _, relation, suffix = words
        a, b = operands.read(1), operands.read(2)
        if relation in UNORDERED_COMPARISONS:
            return operands.put(f"!({a} == {a}) || !({b} == {b}) || {a} {UNORDERED_COMPARISONS[relation]} {b}", "pred")
        if suffix == "f32" and relation == "ne":
            return operands.put(f"{a} < {b} || {a} > {b}", "pred")
        return operands.put(f"{a} {COMPARISONS[relation]} {b}", "pred")

    @staticmethod
    def _conversion(mode: list[str], to: str, source: str, operands: Operands) -> str:
        value, put = operands.read(1, source), operands.put
        if mode == [] and "f32" not in (to, source):
            return put(f"static_cast<{cpp_type(to)}>({value})", to)
        if mode == ["rn"] and to == "f32":
            return put(f"static_cast<float>({value})", to)
        if mode == ["rzi"] and source == "f32" and to in ("s32", "u32"):
            return put(f"to_{cpp_type(to)}({value})", to)
        if len(mode) == 1 and mode[0] in ROUNDINGS and to == source == "f32":
            return put(f"std::{ROUNDINGS[mode[0]]}({value})", to)
        if mode == ["sat"] and to == source == "f32":
            return put(f"saturate({value})", to)
        raise Unknown(".".join(["cvt", *mode, to, source]))

    def _atomic(self, opcode: str, operands: Operands) -> str:
        words = opcode.split(".")
        if opcode in ("atom.global.add.u32", "atom.global.or.b32", "atom.global.max.u32"):
            arguments = f"{self._address(operands.texts[1])}, {operands.read(2, 'u32')}, {self._place}"
            return operands.put(f"machine.atomic_{words[2]}({arguments})", "u32")
        if opcode == "atom.global.cas.b32":
            values = f"{operands.read(2, 'u32')}, {operands.read(3, 'u32')}"
            arguments = f"{self._address(operands.texts[1])}, {values}, {self._place}"
            return operands.put(f"machine.atomic_cas({arguments})", "u32")
        if opcode in ("atom.shared.add.u32", "atom.shared.max.u32"):
            access = self._next_access()
            arguments = f"{self._address(operands.texts[1])}, {operands.read(2, 'u32')}, {self._place}, {access}"
            return operands.put(f"machine.atomic_shared_{words[2]}({arguments})", "u32")
        raise Unknown(opcode)

    def _next_access(self) -> int:
        """The number of an access to global or shared memory, which machine.h checks."""
        self.accesses += 1
        return self.accesses - 1

    def _access(self, head: str, words: list[str], operands: list[str]) -> str:
        """A load or store."""
        # A pointer that was loaded from memory has no space. All such pointers are to device memory, and every access
        # is checked.
        space = "global"
        if words[0] in SPACES:
            space, words = words[0], words[1:]
        words = [w for w in words if w not in ORDERING_WORDS]
        count = 1
        if words[0] in ("v2", "v4"):
            count, words = int(words[0][1]), words[1:]
        kind = words[0]
        target, value = (operands[1], operands[0]) if head == "ld" else (operands[0], operands[1])
        values = split_operands(value[1:-1]) if count > 1 else [value]
        memory, place = "", ""
        if space in ("global", "shared"):
            place = f", {self._place}, {self._next_access()}"
        elif space == "local":
            memory, place = "local, ", f", {self._place}"
        name = f"{space}<{cpp_type(kind)}, {count}>"
        if head == "st":
            stored = ", ".join(self.read(v, kind) for v in values)
            return f"machine.store_{name}({memory}{self._address(target)}, {{{stored}}}{place});"
        load = f"machine.load_{name}({memory}{self._address(target)}{place})"
        if count == 1:
            return self.write(values[0], kind, load + "[0]")
        parts = " ".join(self.write(v, kind, f"loaded[{i}]") for i, v in enumerate(values))
        return f"{{ const auto loaded = {load}; {parts} }}"

    # Lines.

    def add_line(self, text: str) -> None:
        """A line of the kernel's body."""
        if text.endswith(":"):
            self.body.append(f"{label_of(text[:-1])}:;")
            self._starts_block = True
        elif text.startswith("."):
            self._add_directive(text)
        elif text.endswith(";"):
            self._add_instruction(re.sub(r"\s+", " ", text[:-1]))
        else:
            raise Unknown(text)

    def _add_directive(self, text: str) -> None:
        if text.startswith(".reg"):
            self._add_registers(text)
        elif text.startswith((".shared", ".local")):
            self._add_memory(text)
        elif text.startswith(".loc"):
            words = text.split()
            self._place = str(int(words[1]) << 20 | int(words[2].rstrip(",")))
        elif not text.startswith(".pragma"):
            raise Unknown(text)

    def _add_instruction(self, text: str) -> None:
        guard = re.match(r"@(!?)(%p\d+) (.*)", text)
        instruction = guard[3] if guard else text
        self._count(instruction.split(" ")[0])
        statement = self._instruction(instruction)
        if guard:
            self._cpp_of(guard[2])
            statement = f"if ({guard[1]}{self._variable(guard[2])}) {statement}"
        self.body.append(statement)

    def _count(self, opcode: str) -> None:
        """Counts an instruction in its basic block."""
        if self._starts_block:
            self.body.append(f"machine.block({len(self.blocks)});")
            self.blocks.append([0] * len(CLASSES))
        self._starts_block = opcode.split(".")[0] in ("bra", "bar")
        class_ = instruction_class(opcode)
        if class_ is not None:
            self.blocks[-1][CLASSES.index(class_)] += 1

    # Output.

    @property
    def function(self) -> str:
        return f"kernel_{self.module.number}_{self.number}"

    def text(self) -> str:
        local = [f"alignas(16) std::byte local[{self.local_bytes}];"] if self.local_bytes else []
        lines = "".join(f"  {line}\n" for line in local + self.declarations + self.body)
        return f"void {self.function}(const std::byte*) {{\n{lines}}}\n"

    def registration(self) -> str:
        parameters = ", ".join(f"{{{p.offset}, {p.size}}}" for p in self.parameters.values())
        blocks = ", ".join("{" + ", ".join(map(str, block)) + "}" for block in self.blocks)
        return (f'{{"{self.name}", {self.function}, {{{parameters}}}, {self.parameter_bytes}, {self.shared_bytes}, '
                f"{self.local_bytes}, {self.max_threads}, {str(self.barriers > 0).lower()}, {self.module.number}, "
                f"{{{blocks}}}}}")


class Module:
    """One PTX file."""

    def __init__(self, path: str, number: int) -> None:
        self.path, self.number = path, number
        self.kernels: list[Kernel] = []
        self.variables: dict[str, str] = {}  # C++ names of constant arrays
        self.data: list[str] = []  # their definitions
        self.files: dict[int, str] = {}  # source files
        self._kernel: Kernel | None = None  # the one being read
        self._in_body = False
        self._in_section = False
        self._read(path)

    def _read(self, path: str) -> None:
        with open(path, encoding="utf-8") as f:
            for number, raw in enumerate(f, 1):
                line = raw.strip() if raw.lstrip().startswith(".file") else raw.split("//")[0].strip()
                try:
                    if line and not line.startswith((".version", ".target", ".address_size")):
                        self._add_line(line)
                except (Unknown, KeyError, IndexError) as error:
                    sys.exit(f"{path}:{number}: {line}: not supported ({error}); add it in translate_ptx.py")

    def _add_line(self, line: str) -> None:
        if line.startswith(".file"):
            words = line.split(None, 2)
            self.files[int(words[1])] = words[2].split('"')[1]
        elif line.startswith(".section"):
            self._in_section = True
        elif self._in_section:
            self._in_section = line != "}"
        elif self._kernel is None:
            self._add_global(line)
        elif not self._in_body:
            self._add_to_header(self._kernel, line)
        elif line == "}":
            self._kernel, self._in_body = None, False
        else:
            self._kernel.add_line(line)

    def _add_global(self, line: str) -> None:
        entry = re.search(r"\.entry (\S+?)\(", line)
        if entry:
            self._kernel = Kernel(entry[1], len(self.kernels), self)
            self.kernels.append(self._kernel)
        elif line.startswith(".global"):
            self._add_variable(line)
        else:
            raise Unknown(line)

    def _add_to_header(self, kernel: Kernel, line: str) -> None:
        """A line between the name of a kernel and its body."""
        if line == "{":
            self._in_body = True
        elif line.startswith(".param"):
            kernel.add_parameter(line)
        elif line.startswith(".maxntid"):
            kernel.max_threads = int(line.split()[1].rstrip(","))
        elif line != ")":
            raise Unknown(line)

    def _add_variable(self, line: str) -> None:
        match = re.match(r"\.(?:visible )?\.?global \.align (\d+) \.b8 (\S+)\[(\d+)\](?: = \{(.*)\})?;$", line)
        if not match:
            raise Unknown(line)
        alignment, ptx_name, size, values = match.groups()
        name = f"data_{self.number}_{len(self.variables)}"
        self.variables[ptx_name] = name
        array = f"[[maybe_unused]] const unsigned char {name}[{size}] = {{{values or ''}}};"
        self.data.append(f"alignas({max(int(alignment), 16)}) {array}\n"
                         f"const Constant constant_{name}{{{name}, sizeof {name}}};")


def shared_out(modules: list[Module], parts: int) -> list[list[Kernel]]:
    """The kernels of all modules in `parts` lists of about the same length of code."""
    kernels = sorted((k for m in modules for k in m.kernels), key=lambda k: -len(k.body))
    lists: list[list[Kernel]] = [[] for _ in range(parts)]
    for kernel in kernels:
        min(lists, key=lambda part: sum(len(k.body) for k in part)).append(kernel)
    return lists


def write_part(out: TextIO, modules: list[Module], kernels: list[Kernel], with_files: bool) -> None:
    out.write('#include "emulated_cuda/machine.h"\nnamespace trisoup::emulated_cuda {\nnamespace {\n')
    for module in modules:
        out.write("\n".join(module.data) + "\n")
    for kernel in kernels:
        out.write(kernel.text())
    rows = "".join(f"    {kernel.registration()},\n" for kernel in kernels)
    out.write(f"const Registration registration{{\n{rows}}};\n")
    for module in modules if with_files else []:
        for number, path in module.files.items():
            name = f"file_{module.number}_{number}"
            out.write(f'const SourceFile {name}{{{module.number}, {number}, "{path}"}};\n')
    out.write("}  // namespace\n}  // namespace trisoup::emulated_cuda\n")


def main(arguments: list[str]) -> int:
    if arguments[:1] in (["-h"], ["--help"]):
        print(__doc__)
        return 0
    if len(arguments) < 3:
        print(__doc__, file=sys.stderr)
        return 1
    prefix, parts = arguments[0], int(arguments[1])
    modules = [Module(path, i) for i, path in enumerate(arguments[2:])]
    for i, kernels in enumerate(shared_out(modules, parts)):
        with open(f"{prefix}_{i}.cpp", "w", encoding="utf-8") as out:
            write_part(out, modules, kernels, with_files=i == 0)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

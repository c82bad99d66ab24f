#!/usr/bin/env python3
"""PTX of nvcc to C++, so that what nvcc makes of the kernels runs where there is no GPU.

usage: translate_ptx.py OUTPUT_PREFIX PARTS FILE.ptx...

Writes OUTPUT_PREFIX_0.cpp ... for machine.h to run: one function a kernel, one statement an instruction. It knows the instructions
that our kernels have and ends with the line of any other one. The meaning of each is that of NVIDIA's "PTX ISA" manual, version 9.0.
"""
import re
import sys

BITS = {"b8": 8, "u8": 8, "s8": 8, "b16": 16, "u16": 16, "s16": 16, "b32": 32, "u32": 32, "s32": 32, "f32": 32, "b64": 64, "u64": 64, "s64": 64}
CPP = {"pred": "bool", "b16": "uint16_t", "b32": "uint32_t", "f32": "float", "b64": "uint64_t"}
SPECIAL = {"%tid.x": "machine.thread()", "%ctaid.x": "machine.group()", "%ntid.x": "machine.threads()", "%nctaid.x": "machine.groups()"}
COMPARISONS = {"eq": "==", "ne": "!=", "lt": "<", "le": "<=", "gt": ">", "ge": ">=", "lo": "<", "ls": "<=", "hi": ">", "hs": ">="}
UNORDERED = {"equ": "==", "neu": "!=", "ltu": "<", "leu": "<=", "gtu": ">", "geu": ">="}

# Instructions whose operands all have the type that they end with: the C++ of their result.
EXPRESSIONS = {
    "add.rn.f32": "{1} + {2}", "add.f32": "{1} + {2}", "sub.rn.f32": "{1} - {2}", "sub.f32": "{1} - {2}", "mul.rn.f32": "{1} * {2}", "mul.f32": "{1} * {2}",
    "div.rn.f32": "{1} / {2}", "fma.rn.f32": "std::fma({1}, {2}, {3})", "fma.rm.f32": "fma_down({1}, {2}, {3})", "rcp.rn.f32": "1.0f / {1}",
    "sqrt.rn.f32": "std::sqrt({1})", "ex2.approx.ftz.f32": "exp2_flushed({1})", "abs.f32": "std::fabs({1})", "neg.f32": "-{1}",
    "min.f32": "min_number({1}, {2})", "max.f32": "max_number({1}, {2})", "min.s32": "std::min({1}, {2})", "max.s32": "std::max({1}, {2})",
    "min.u32": "std::min({1}, {2})", "max.u32": "std::max({1}, {2})", "div.u32": "divide({1}, {2})", "rem.u32": "remainder({1}, {2})",
    "bfi.b32": "insert_bits({1}, {2}, {3}, {4})", "brev.b32": "reverse_bits({1})", "bfind.shiftamt.u32": "shift_of_first_bit({1})",
}

# What a GPU has units for, as in machine.h. What ptxas makes no instruction of (moves, addresses, parameters) does not count.
SPACES = ("param", "global", "shared", "local")
CLASSES = ["multiply_add", "special", "other", "shared", "global", "local", "atomic"]


def instruction_class(opcode):
    words = opcode.split(".")
    if words[0] in ("mov", "cvta") or opcode.startswith("ld.param"):
        return None
    if words[0] in ("ld", "st"):
        return words[1] if words[1] in SPACES else "global"
    if words[0] == "atom":
        return "shared" if words[1] == "shared" else "atomic"
    if words[-1] == "f32" and words[0] in ("add", "sub", "mul", "fma"):
        return "multiply_add"
    if words[-1] == "f32" and words[0] in ("div", "rcp", "sqrt", "ex2"):
        return "special"
    return "other"


class Unknown(Exception):
    pass


def cpp_type(suffix):
    if suffix == "f32":
        return "float"
    if suffix == "pred":
        return "bool"
    return ("int" if suffix[0] == "s" else "uint") + f"{BITS[suffix]}_t"


def split_operands(text):
    """At the commas that are outside of braces and brackets."""
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


class Kernel:
    def __init__(self, name, number, module):
        self.name, self.number, self.module = name, number, module
        self.parameters, self.parameter_bytes = {}, 0
        self.registers = {}  # prefix of its names: type
        self.shared, self.shared_bytes = {}, 0
        self.local, self.local_bytes = {}, 0
        self.barriers = 0
        self.accesses = 0
        self.most_threads = 1024
        self.declarations, self.body = [], []
        self.blocks = []      # instructions of each class in each run of them that is entered at its start only
        self.new_block = True
        self.place = "0"

    def parameter(self, line):
        match = re.match(r"\.param (?:\.align (\d+) )?\.(\w+) (\S+?)(?:\[(\d+)\])?,?$", line)
        if not match:
            raise Unknown(line)
        size = BITS[match[2]] // 8
        align = max(int(match[1] or 1), size)
        offset = (self.parameter_bytes + align - 1) // align * align
        self.parameters[match[3]] = (offset, size * int(match[4] or 1))
        self.parameter_bytes = offset + size * int(match[4] or 1)

    def memory(self, line):
        match = re.match(r"\.(shared|local) (?:\.align (\d+) )?\.(\w+)\s+(\S+?)(?:\[(\d+)\])?;$", line)
        if not match:
            raise Unknown(line)
        size = BITS[match[3]] // 8 * int(match[5] or 1)
        align = max(int(match[2] or 1), BITS[match[3]] // 8)
        table, used = (self.shared, self.shared_bytes) if match[1] == "shared" else (self.local, self.local_bytes)
        offset = (used + align - 1) // align * align
        table[match[4]] = offset
        if match[1] == "shared":
            self.shared_bytes = offset + size
        else:
            self.local_bytes = offset + size

    def register_type(self, name):
        prefix = name.rstrip("0123456789")
        return self.registers.get(name) or self.registers.get(prefix)

    def variable(self, name):
        if not self.register_type(name):
            raise Unknown(name)
        return "r_" + name[1:].replace(".", "_")

    def read(self, operand, suffix):
        """The operand as a C++ expression of the type that the suffix names."""
        want = cpp_type(suffix)
        if operand in SPECIAL:
            return f"{want}({SPECIAL[operand]})"
        if operand.startswith("%"):
            have = CPP[self.register_type(operand)] if self.register_type(operand) else None
            name = self.variable(operand)
            if have == want:
                return name
            if "float" in (have, want):
                return f"std::bit_cast<{want}>({name})"
            return f"static_cast<{want}>({name})"
        if re.match(r"0[fF][0-9A-Fa-f]{8}$", operand):
            return f"std::bit_cast<float>(0x{operand[2:]}u)"
        if re.match(r"-?(0x[0-9A-Fa-f]+|\d+)$", operand):
            if suffix == "pred":
                return "true" if int(operand, 0) else "false"
            value = int(operand, 0) & ((1 << BITS[suffix]) - 1)
            return f"static_cast<{want}>({value}ull)"
        return f"static_cast<{want}>({self.symbol(operand)})"

    def symbol(self, name):
        if name in self.parameters:
            return f"machine.parameters({self.parameters[name][0]})"
        if name in self.shared:
            return f"{self.shared[name]}ull"
        if name in self.local:
            return f"(reinterpret_cast<uint64_t>(local) + {self.local[name]})"
        if name in self.module.variables:
            return f"reinterpret_cast<uint64_t>({self.module.variables[name]})"
        raise Unknown(name)

    def write(self, operand, suffix, expression):
        have = CPP[self.register_type(operand)] if self.register_type(operand) else None
        name = self.variable(operand)
        want = cpp_type(suffix)
        if have != want and "float" in (have, want):
            return f"{name} = std::bit_cast<{have}>({expression});"
        if have != want:
            return f"{name} = static_cast<{have}>(static_cast<{want}>({expression}));"
        return f"{name} = {expression};"

    def address(self, operand):
        match = re.match(r"\[(\S+?)(?:\+(-?\d+))?\]$", operand)
        if not match:
            raise Unknown(operand)
        base = self.read(match[1], "u64") if match[1].startswith("%") else self.symbol(match[1])
        return f"{base} + static_cast<uint64_t>({match[2]}ll)" if match[2] else base

    def instruction(self, text):
        """C++ of one instruction without its guard."""
        opcode, _, rest = text.partition(" ")
        rest = rest.strip()
        words = opcode.split(".")
        head, suffix = words[0], words[-1]
        if head == "bra":
            return f"goto {self.label(rest)};"
        if head == "ret":
            return "return;"
        operands = split_operands(rest)

        def r(index, kind=suffix):
            return self.read(operands[index], kind)

        def put(expression, kind=suffix):
            return self.write(operands[0], kind, expression)

        if head == "mov":
            return put(r(1))
        if head in ("ld", "st"):
            return self.access(head, words[1:], operands)
        if head == "atom":
            if opcode in ("atom.global.add.u32", "atom.global.or.b32", "atom.global.max.u32"):
                return put(f"machine.atomic_{words[2]}({self.address(operands[1])}, {r(2, 'u32')}, {self.place})", "u32")
            if opcode == "atom.global.cas.b32":
                return put(f"machine.atomic_cas({self.address(operands[1])}, {r(2, 'u32')}, {r(3, 'u32')}, {self.place})", "u32")
            if opcode not in ("atom.shared.add.u32", "atom.shared.max.u32"):
                raise Unknown(text)
            self.accesses += 1
            return put(f"machine.atomic_shared_{words[2]}({self.address(operands[1])}, {r(2, 'u32')}, {self.place}, {self.accesses - 1})", "u32")
        if head == "bar" or head == "barrier":
            if words[1:] != ["sync"] or operands != ["0"]:
                raise Unknown(text)
            self.barriers += 1
            return f"machine.barrier({self.barriers}u, {self.place});"
        if head == "membar" or head == "fence":
            return ";"
        if head == "cvta":
            return put(r(1, "u64"), "u64")
        if opcode in EXPRESSIONS:
            return put(EXPRESSIONS[opcode].format("", *(r(i) for i in range(1, len(operands)))))
        if suffix == "f32" and head not in ("mov", "selp", "setp", "cvt") or head in ("add", "sub", "and", "or", "xor", "not", "shl", "shr", "selp") and len(words) != 2:
            raise Unknown(text)  # with a modifier, or not known
        if head in ("add", "sub", "and", "or", "xor"):
            sign = {"add": "+", "sub": "-", "and": "&", "or": "|", "xor": "^"}[head]
            if suffix == "pred":
                return put(f"static_cast<bool>({r(1)} {sign} {r(2)})")
            kind = "u" + suffix[1:]
            return put(f"static_cast<{cpp_type(kind)}>({r(1, kind)} {sign} {r(2, kind)})", kind)
        if head == "not":
            return put(f"!{r(1)}" if suffix == "pred" else f"static_cast<{cpp_type(suffix)}>(~{r(1)})")
        if opcode == "neg.s32":
            return put(f"static_cast<uint32_t>(0u - {r(1, 'u32')})", "u32")
        if head == "mul" and words[1] == "wide":
            wide = suffix[0] + str(2 * BITS[suffix])
            return put(f"static_cast<{cpp_type(wide)}>({r(1)}) * static_cast<{cpp_type(wide)}>({r(2)})", wide)
        if head in ("mul", "mad") and words[1] == "lo":
            kind = "u" + suffix[1:]
            added = f" + {r(3, kind)}" if head == "mad" else ""
            return put(f"static_cast<{cpp_type(kind)}>(uint64_t{{{r(1, kind)}}} * {r(2, kind)}{added})", kind)
        if head in ("mul", "mad"):
            raise Unknown(text)
        if head in ("shl", "shr"):
            return put(f"shift_{dict(shl='left', shr='right')[head]}({r(1)}, {r(2, 'u32')})")
        if head == "selp":
            return put(f"{r(3, 'pred')} ? {r(1)} : {r(2)}")
        if head == "setp":
            if len(words) != 3:
                raise Unknown(text)
            if words[1] in UNORDERED:
                return put(f"!({r(1)} == {r(1)}) || !({r(2)} == {r(2)}) || {r(1)} {UNORDERED[words[1]]} {r(2)}", "pred")
            ordered = f"{r(1)} {COMPARISONS[words[1]]} {r(2)}"
            if suffix == "f32" and words[1] == "ne":
                ordered = f"{r(1)} < {r(2)} || {r(1)} > {r(2)}"
            return put(ordered, "pred")
        if head == "cvt":
            return self.conversion(words[1:], put, r, text)
        raise Unknown(text)

    def conversion(self, words, put, r, text):
        to, source = words[-2], words[-1]
        mode = words[:-2]
        if mode == [] and "f32" not in (to, source):
            return put(f"static_cast<{cpp_type(to)}>({r(1, source)})", to)
        if mode == ["rn"] and to == "f32":
            return put(f"static_cast<float>({r(1, source)})", to)
        if mode == ["rzi"] and source == "f32" and to in ("s32", "u32"):
            return put(f"to_{cpp_type(to)}({r(1, source)})", to)
        if mode in (["rmi"], ["rpi"], ["rzi"], ["rni"]) and to == source == "f32":
            return put(f"std::{dict(rmi='floor', rpi='ceil', rzi='trunc', rni='nearbyint')[mode[0]]}({r(1, source)})", to)
        if mode == ["sat"] and to == source == "f32":
            return put(f"saturate({r(1, source)})", to)
        raise Unknown(text)

    def access(self, head, words, operands):
        # A pointer that was itself read from memory has no space; all of ours point to device memory, and every access is checked.
        space, words = (words[0], words[1:]) if words[0] in SPACES else ("global", words)
        words = [w for w in words if w not in ("nc", "volatile", "relaxed", "gpu", "cta", "sys")]
        count = 1
        if words[0] in ("v2", "v4"):
            count = int(words[0][1])
            words = words[1:]
        kind = words[0]
        target, value = (operands[1], operands[0]) if head == "ld" else (operands[0], operands[1])
        values = split_operands(value[1:-1]) if count > 1 else [value]
        own, place = "", ""
        if space in ("global", "shared"):
            place = f", {self.place}, {self.accesses}"
            self.accesses += 1
        elif space == "local":
            own, place = "local, ", f", {self.place}"
        types = f"<{cpp_type(kind)}, {count}>"
        if head == "st":
            return f"machine.store_{space}{types}({own}{self.address(target)}, {{{', '.join(self.read(v, kind) for v in values)}}}{place});"
        load = f"machine.load_{space}{types}({own}{self.address(target)}{place})"
        if count == 1:
            return self.write(values[0], kind, load + "[0]")
        return f"{{ const auto loaded = {load}; " + " ".join(self.write(v, kind, f"loaded[{i}]") for i, v in enumerate(values)) + " }"

    def label(self, name):
        return "L_" + name.strip().strip("$").replace("$", "_")

    def line(self, text):
        if text.endswith(":"):
            self.body.append(f"{self.label(text[:-1])}:;")
            self.new_block = True
            return
        if text.startswith(".reg"):
            match = re.match(r"\.reg \.(\w+)\s+(%\w+?)(?:<(\d+)>)?;$", text)
            if not match:
                raise Unknown(text)
            self.registers[match[2]] = match[1] if match[1] in CPP else "b" + match[1][1:]
            names = [f"{match[2]}{i}" for i in range(int(match[3]))] if match[3] else [match[2]]
            for start in range(0, len(names), 16):
                self.declarations.append(f"{CPP[self.registers[match[2]]]} " + ", ".join("r_" + n[1:] for n in names[start:start + 16]) + ";")
            return
        if text.startswith((".shared", ".local")):
            self.memory(text)
            return
        if text.startswith(".loc"):
            words = text.split()
            self.place = str(int(words[1]) << 20 | int(words[2].rstrip(",")))
            return
        if text.startswith(".pragma"):
            return
        if text.startswith("."):
            raise Unknown(text)
        if not text.endswith(";"):
            raise Unknown(text)
        text = re.sub(r"\s+", " ", text[:-1])
        guard = re.match(r"@(!?)(%p\d+) (.*)", text)
        opcode = (guard[3] if guard else text).split(" ")[0]
        if self.new_block:
            self.body.append(f"machine.block({len(self.blocks)});")
            self.blocks.append([0] * len(CLASSES))
        self.new_block = opcode.split(".")[0] in ("bra", "bar")
        if instruction_class(opcode):
            self.blocks[-1][CLASSES.index(instruction_class(opcode))] += 1
        if guard:
            self.body.append(f"if ({guard[1]}{self.variable(guard[2])}) {self.instruction(guard[3])}")
        else:
            self.body.append(self.instruction(text))

    def text(self):
        local = f"  alignas(16) std::byte local[{self.local_bytes}];\n" if self.local_bytes else ""
        return (f"void kernel_{self.module.number}_{self.number}(const std::byte*) {{\n" + local
                + "".join(f"  {d}\n" for d in self.declarations) + "".join(f"  {b}\n" for b in self.body) + "}\n")


class Module:
    def __init__(self, path, number):
        self.path, self.number = path, number
        self.kernels, self.variables, self.data, self.files = [], {}, [], {}
        self.read(path)

    def variable(self, line):
        match = re.match(r"\.(?:visible )?\.?global \.align (\d+) \.b8 (\S+)\[(\d+)\](?: = \{(.*)\})?;$", line)
        if not match:
            raise Unknown(line)
        name = f"data_{self.number}_{len(self.variables)}"
        self.variables[match[2]] = name
        self.data.append(f"alignas({max(int(match[1]), 16)}) [[maybe_unused]] const unsigned char {name}[{match[3]}] = {{{match[4] or ''}}};\n"
                         f"const Constant constant_{name}{{{name}, sizeof {name}}};")

    def read(self, path):
        kernel, inside, skipping = None, False, False
        for number, raw in enumerate(open(path), 1):
            line = raw.split("//")[0].strip() if not raw.lstrip().startswith(".file") else raw.strip()
            try:
                if not line or line.startswith((".version", ".target", ".address_size")):
                    continue
                if line.startswith(".file"):
                    words = line.split(None, 2)
                    self.files[int(words[1])] = words[2].split('"')[1]
                elif line.startswith(".section"):
                    skipping = True
                elif skipping:
                    skipping = line != "}"
                elif kernel is None and ".entry" in line:
                    kernel = Kernel(re.search(r"\.entry (\S+?)\(", line)[1], len(self.kernels), self)
                    self.kernels.append(kernel)
                elif kernel is None and line.startswith(".global"):
                    self.variable(line)
                elif kernel is None:
                    raise Unknown(line)
                elif not inside:
                    if line == "{":
                        inside = True
                    elif line.startswith(".param"):
                        kernel.parameter(line)
                    elif line.startswith(".maxntid"):
                        kernel.most_threads = int(line.split()[1].rstrip(","))
                    elif line != ")":
                        raise Unknown(line)
                elif line == "}":
                    kernel, inside = None, False
                else:
                    kernel.line(line)
            except (Unknown, KeyError, IndexError) as problem:
                sys.exit(f"{path}:{number}: cannot be translated: {line} ({problem})")


def main():
    if len(sys.argv) < 4 or sys.argv[1] in ("-h", "--help"):
        sys.exit(__doc__)
    prefix, parts = sys.argv[1], int(sys.argv[2])
    modules = [Module(path, i) for i, path in enumerate(sys.argv[3:])]
    kernels = sorted((k for m in modules for k in m.kernels), key=lambda k: -len(k.body))
    share = [[] for _ in range(parts)]
    for kernel in kernels:
        min(share, key=lambda s: sum(len(k.body) for k in s)).append(kernel)
    for i, part in enumerate(share):
        with open(f"{prefix}_{i}.cpp", "w") as out:
            out.write('#include "emulated_cuda/machine.h"\nnamespace trisoup::emulated_cuda {\nnamespace {\n')
            for module in modules:
                out.write("\n".join(module.data) + "\n")
            for kernel in part:
                out.write(kernel.text())
            out.write("const Registration registration{\n")
            for k in part:
                offsets = ", ".join(f"{{{offset}, {size}}}" for offset, size in k.parameters.values())
                out.write(f'    {{"{k.name}", kernel_{k.module.number}_{k.number}, {{{offsets}}}, {k.parameter_bytes}, {k.shared_bytes}, {k.local_bytes}, {k.most_threads}, '
                          f'{str(k.barriers > 0).lower()}, {k.module.number}, {{{", ".join("{" + ", ".join(map(str, b)) + "}" for b in k.blocks)}}}}},\n')
            out.write("};\n")
            if i == 0:
                for module in modules:
                    for number, path in module.files.items():
                        out.write(f'const SourceFile file_{module.number}_{number}{{{module.number}, {number}, "{path}"}};\n')
            out.write("}  // namespace\n}  // namespace trisoup::emulated_cuda\n")


if __name__ == "__main__":
    main()

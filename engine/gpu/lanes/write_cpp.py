"""A kernel as C++ in the words of lanes.h and lane_memory.h."""
from expressions import Expressions, fold
from parts import Leaf, Types
from spirv import fail
from uniformity import is_uniform
from write_control import ControlWriter
from write_locals import LocalsWriter
from write_memory import MemoryWriter


class Writer(MemoryWriter, LocalsWriter, ControlWriter):
    """The C++ of one program (uniformity.Program)."""

    def __init__(self, program, name):
        self.p, self.m, self.name = program, program.m, name
        self.kinds = Types(self.m)
        self.expressions = Expressions(self.kinds)
        self.lines, self.depth, self.temporary = [], 1, 0
        self.labels = set()
        self.trees, self.known, self.counting = {}, {}, {}  # values; those of them that are numbers now; counters of unrolled loops
        self.makers = {n.key: n for n in program.insts if n.key is not None}

    def out(self, text):
        self.lines.append("  " * self.depth + text)

    def fresh(self, stem):
        self.temporary += 1
        return f"{stem}{self.temporary}"

    # values
    def tree(self, key):
        if key not in self.p.types:
            return self.kinds.literal(key[0])
        return self.trees[key]

    def number(self, key):
        """An integer that is known while translating, else None."""
        if key not in self.p.types:
            return self.m.constant(key[0])
        return self.known.get(key)

    def differs(self, key):
        """Whether any part of a value may differ between lanes."""
        return not is_uniform(self.p.class_of(key))

    @staticmethod
    def stem(key):
        return f"result_{key[1]}" if isinstance(key[0], str) else f"x{key[0]}_{key[1]}"

    def wanted(self, type_, c):
        """Tree of whether a value's scalars are held over the lanes."""
        if self.kinds.is_scalar(type_):
            return not is_uniform(c)
        return [self.wanted(t, x) for t, x in zip(self.kinds.parts(type_), self.kinds.part_classes(type_, c))]

    def declare(self, key, type_):
        """Declares a variable of the kernel's, or a value that is set where control comes from."""
        indexed = self.indexed.get(key, set())
        self.trees[key], declared = self.kinds.variables(type_, self.p.class_of(key), self.stem(key), indexed)
        for name, (cpp, dimensions) in declared.items():
            # Lanes that take no part leave what was there, so something has to be; clearing arrays shows in profiles.
            self.out(f"[[maybe_unused]] {cpp} {name}{dimensions}{'' if dimensions else '{}'};")

    def define(self, key, type_, texts, wanted):
        """Gives a value's scalars names."""
        count = 0

        def name(leaf_type, text, w):
            nonlocal count
            if not self.kinds.is_scalar(leaf_type):
                return [name(t, x, y) for t, x, y in zip(self.kinds.parts(leaf_type), text, w)]
            count += 1
            variable = f"{self.stem(key)}_{count}"
            self.out(f"[[maybe_unused]] const {self.kinds.scalar(leaf_type, w)} {variable} = {text};")
            return Leaf(variable, w)
        self.trees[key] = name(type_, texts, wanted)

    # instructions
    def instruction(self, n, mask):
        inst, op = n.inst, n.inst.op
        if op == "Variable":
            self.declare(n.key, self.p.types[n.key])
        elif op in ("AccessChain", "InBoundsAccessChain", "MemoryBarrier"):
            return
        elif op == "Undef":
            self.trees[n.key] = self.kinds.zeros(inst.type)
        elif op == "ControlBarrier":
            if self.p.width < self.m.local_size:
                self.out("barrier();")
        elif op == "Store":
            if self.p.pointer(n.args[0])[0] == 7:
                self.store_local(n, mask)
            else:
                self.store_memory(n.args[1], n.args[0], mask)
        elif op == "Load":
            storage, root, _, _ = self.p.pointer(n.args[0])
            if storage == 7:
                self.load_local(n)
            elif storage == 1:
                self.trees[n.key] = self.builtin(root, n.args[0])
            else:
                self.load_memory(n.key, n.args[0], mask)
        elif op.startswith("Atomic"):
            self.atomic(n, mask)
        elif not self.rearranged(n):
            self.operation(n)

    def builtin(self, root, pointer):
        which = self.m.decorations[root[0]][11][0]
        if which == 29:
            return Leaf("lane", True)
        path = self.p.pointer(pointer)[2]
        component = self.m.constant(path[0][0]) if path else None
        if component is None or which not in (24, 26):
            fail(f"{self.m.path}: builtin {which} as a whole, or not known")
        return Leaf("1u" if which == 24 else "group" if component == 0 else "0u", False)

    def rearranged(self, n):
        """Takes a value for which no code is needed; false for others."""
        inst, op = n.inst, n.inst.op
        if op == "CompositeConstruct":
            parts = []
            for a in n.args:
                part = self.tree(a)
                parts += part if self.kinds.of(inst.type).op == "TypeVector" and isinstance(part, list) else [part]
            self.trees[n.key] = parts
        elif op == "CompositeExtract":
            tree = self.tree(n.args[0])
            for index in inst.args[1:]:
                tree = tree[index]
            self.trees[n.key] = tree
        elif op == "VectorShuffle":
            both = self.tree(n.args[0]) + self.tree(n.args[1])
            self.trees[n.key] = [both[i] for i in inst.args[2:]]
        elif op in ("CopyObject", "CopyLogical"):
            self.trees[n.key] = self.tree(n.args[0])
        else:
            return False
        return True

    def operation(self, n):
        inst = n.inst
        scalar = self.kinds.is_scalar(inst.type)
        if scalar and self.kinds.of(inst.type).op in ("TypeInt", "TypeBool"):
            t = self.kinds.of(inst.type)
            value = fold(inst.op, [self.number(a) if a is not None else None for a in n.args], t.op == "TypeInt" and not t.args[1])
            if value is not None:
                self.known[n.key] = value
                self.trees[n.key] = self.kinds.number(inst.type, value)
                return
        wanted = self.wanted(inst.type, self.p.class_of(n.key))
        args = [None if a is None else self.tree(a) for a in n.args]
        by_one = inst.op in ("UDiv", "SDiv", "UMod", "SRem") and scalar and not self.differs(n.args[1])
        self.define(n.key, inst.type, self.expressions.of(inst, args, wanted, by_one), wanted)

    def write(self):
        self.exit_mask, self.last_return, self.return_label = {}, {}, {}
        self.find_indexed()
        self.used = set()
        for n in self.p.insts:
            self.used |= set(n.args)
        for accesses in self.p.accesses.values():
            for a in accesses:
                if a[3].kind in ("phi", "return") and a[3].value is not None:
                    self.used.add(a[3].value)
        self.inline(self.p.tree, None)
        shared = []
        for v in self.m.globals:
            if self.m.ids[v.type].args[0] == 4:
                words = self.kinds.words(self.m.ids[v.type].args[1])
                shared.append(f"[[maybe_unused]] alignas(64) thread_local std::uint32_t shared_{v.id}[{words}];")
        barriers = self.p.width < self.m.local_size and any(n.inst.op == "ControlBarrier" for n in self.p.insts)
        text = f"namespace {self.name} {{\nnamespace {{\n" + "\n".join(shared) + "\n}\n"
        text += "void run([[maybe_unused]] const std::byte* arguments) {\n  [[maybe_unused]] const vu lane = lanes_from(invocation.thread);\n"
        text += "  [[maybe_unused]] const std::uint32_t group = invocation.group;\n"
        text += "\n".join(self.lines) + "\n}\n}\n"
        return text, barriers

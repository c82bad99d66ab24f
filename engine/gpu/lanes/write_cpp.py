"""A kernel as C++ in the words of lanes.h and lane_memory.h."""
from spirv import BINARY, COMPARE, fail
from uniformity import ALIGNED, COMPONENT, CONSECUTIVE, QUARTER, VARYING, is_uniform, leaves

EXT = {4: "fabs_", 6: "fsign_", 8: "floor_", 9: "ceil_", 27: "exp_", 31: "sqrt_", 37: "fmin_", 38: "umin_", 39: "smin_", 40: "fmax_",
       41: "umax_", 42: "smax_", 43: "fclamp_", 44: "uclamp_", 45: "sclamp_", 69: "normalize_", 73: "find_lsb_"}

SCALARS = {"vm": "bool", "vf": "float", "vu": "std::uint32_t", "vi": "std::int32_t"}  # what a lane of a vector is


class Writer:
    """The C++ of one program (uniformity.Program)."""

    def __init__(self, program, name):
        self.p, self.m, self.name = program, program.m, name
        self.lines, self.structs, self.struct_text = [], {}, []
        self.depth, self.temporary = 1, 0
        self.labels = set()

    def out(self, text):
        self.lines.append("  " * self.depth + text)

    def fresh(self, stem):
        self.temporary += 1
        return f"{stem}{self.temporary}"

    # types
    def cpp(self, type_, varying):
        t = self.m.ids[type_]
        if t.op == "TypeBool":
            return "vm" if varying else "bool"
        if t.op == "TypeInt":
            return ("vi" if varying else "std::int32_t") if t.args[1] else ("vu" if varying else "std::uint32_t")
        if t.op == "TypeFloat":
            return "vf" if varying else "float"
        if t.op == "TypeVector":
            return f"vec<{self.cpp(t.args[0], varying)}, {t.args[1]}>"
        if t.op == "TypeMatrix":
            return f"vec<{self.cpp(t.args[0], varying)}, {t.args[1]}>"
        if t.op == "TypeArray":
            return f"arr<{self.cpp(t.args[0], varying)}, {self.m.constant(t.args[1])}>"
        if t.op == "TypeStruct":
            return self.struct(type_, varying)
        if t.op == "TypePointer":
            return "ptr"
        fail(f"{self.m.path}: a value of {t.op}")

    def struct(self, type_, varying):
        members = [self.cpp(x, varying) for x in self.m.ids[type_].args]
        key = tuple(members)
        if key not in self.structs:
            name = f"S{len(self.structs)}"
            self.structs[key] = name
            self.struct_text.append(f"struct {name} {{ " + " ".join(f"{x} m{i};" for i, x in enumerate(members)) + " };")
        return self.structs[key]

    def rep(self, key):
        """Whether a value is held as a vector."""
        return not is_uniform(self.p.class_of(key))

    def ident(self, key):
        if isinstance(key[0], str):
            return f"result_{key[1]}"
        return f"x{key[0]}_{key[1]}"

    def literal(self, key):
        inst = self.m.ids[key[0]]
        if inst.op in ("ConstantNull", "Undef"):
            return f"{self.cpp(inst.type, False)}{{}}"
        if inst.op in ("ConstantComposite", "SpecConstantComposite"):
            parts = ", ".join(self.literal((a, 0)) for a in inst.args)
            braces = ("{", "}") if self.m.ids[inst.type].op == "TypeStruct" else ("{{", "}}")
            return f"{self.cpp(inst.type, False)}{braces[0]}{parts}{braces[1]}"
        value = self.m.constant(key[0])
        if value is None:
            fail(f"{self.m.path}: {inst.op} is not a value")
        if isinstance(value, bool):
            return "true" if value else "false"
        if isinstance(value, float):
            return f"{value.hex()}f" if abs(value) < float("inf") else fail(f"{self.m.path}: a constant that is no number")
        signed = self.m.ids[inst.type].args[1]
        return f"std::int32_t({value})" if signed else f"{value}u"

    def uniform(self, key):
        """Expression of a value held as a scalar."""
        if key not in self.p.types:
            return self.literal(key)
        return self.ident(key)

    def get(self, key, varying):
        """Expression of a value, as a vector if `varying`."""
        text = self.uniform(key)
        if self.rep(key) != varying:
            return f"vary({text})" if varying else f"first({text})"
        return text

    # addresses
    def layout(self, type_):
        """Bytes of a type as C++ holds it as scalars."""
        t = self.m.ids[type_]
        if t.op == "TypeVector" or t.op == "TypeMatrix":
            return self.layout(t.args[0]) * t.args[1]
        if t.op == "TypeArray":
            return self.layout(t.args[0]) * self.m.constant(t.args[1])
        if t.op == "TypeStruct":
            return sum(self.layout(x) for x in t.args)
        if t.op == "TypePointer":
            return 8
        return 4

    def address(self, key):
        """(uniform address as an expression, list of varying (index expression, stride, class), type, is shared memory)."""
        storage, root, path, type_ = self.p.pointer(key)
        explicit = storage in (5349, 9)
        if storage == 9:
            base = "const_cast<char*>(reinterpret_cast<const char*>(arguments))"
        elif storage == 5349:
            base = self.uniform(root)
            if self.rep(root):
                fail(f"{self.m.path}: an address that differs between lanes")
        else:
            base = f"reinterpret_cast<char*>(&{self.shared_name(root)})"
        offset, terms = 0, []
        uniform_terms = []
        for index in path:
            t = self.m.ids[type_]
            known = self.m.constant(index[0])
            if t.op == "TypeStruct":
                if explicit:
                    offset += self.m.member_offsets[type_, known]
                    self.matrix_stride = self.m.matrix_strides.get((type_, known), 16)
                else:
                    offset += sum(self.layout(x) for x in t.args[:known])
                type_ = t.args[known]
                continue
            if t.op in ("TypeArray", "TypeRuntimeArray"):
                stride = self.m.decorations[type_][6][0] if explicit else self.layout(t.args[0])
            elif t.op == "TypeMatrix":
                stride = self.matrix_stride if explicit else self.layout(t.args[0])
            else:
                stride = 4
            type_ = t.args[0]
            if known is not None:
                offset += known * stride
            elif self.rep(index):
                terms.append((index, stride, self.p.class_of(index)))
            else:
                uniform_terms.append(f"std::size_t({self.uniform(index)}) * {stride}")
        text = " + ".join([base] + uniform_terms + ([str(offset)] if offset else []))
        return text, terms, type_, storage == 4

    def index(self, terms):
        """(index expression as vu, stride, class) of varying terms."""
        if len(terms) == 1:
            index, stride, c = terms[0]
            return f"as_u({self.uniform(index)})", stride, c
        step = terms[0][1]
        for _, stride, _ in terms[1:]:
            while stride:
                step, stride = stride, step % stride
        parts = [f"as_u({self.uniform(i)}) * {s // step}u" for i, s, _ in terms]
        in_a_row = sorted((s, c) for _, s, c in terms) == [(4, COMPONENT), (16, QUARTER)]
        return "(" + " + ".join(parts) + ")", step, CONSECUTIVE if in_a_row else VARYING

    def leaves(self, type_, explicit, offset=0, path=""):
        """(offset, type, C++ member path) of the scalars and vectors of a type in memory."""
        t = self.m.ids[type_]
        if t.op == "TypeStruct":
            at = 0
            for i, x in enumerate(t.args):
                o = self.m.member_offsets[type_, i] if explicit else at
                self.matrix_stride = self.m.matrix_strides.get((type_, i), 16)
                yield from self.leaves(x, explicit, offset + o, f"{path}.m{i}")
                at += self.layout(x)
        elif t.op == "TypeArray":
            stride = self.m.decorations[type_][6][0] if explicit else self.layout(t.args[0])
            for i in range(self.m.constant(t.args[1])):
                yield from self.leaves(t.args[0], explicit, offset + i * stride, f"{path}.v[{i}]")
        elif t.op == "TypeMatrix":
            stride = self.matrix_stride if explicit else self.layout(t.args[0])
            for i in range(t.args[1]):
                yield from self.leaves(t.args[0], explicit, offset + i * stride, f"{path}.c[{i}]")
        else:
            yield offset, type_, path

    def shared_name(self, root):
        return f"shared_{root[0]}"

    def load_memory(self, name, pointer, mask):
        text, terms, type_, shared = self.address(pointer)
        explicit = not shared
        base = self.fresh("p")
        self.out(f"char* const {base} = {text};")
        if not terms:
            self.out(f"{self.cpp(type_, False)} {name};")
            for offset, t, path in self.leaves(type_, explicit):
                self.out(f"load_one({base} + {offset}, {name}{path});")
            return
        index, stride, c = self.index(terms)
        self.out(f"{self.cpp(type_, True)} {name};")
        at = self.fresh("i")
        # Lanes that take no part read what lies beside the others: words there is room for, larger steps not.
        run = c in (ALIGNED, CONSECUTIVE) and (mask is None or stride == 4)
        self.out(f"const vu {at} = {index};" if mask is None or run else f"const vu {at} = {index} & as_u({mask});")
        for offset, t, path in self.leaves(type_, explicit):
            if run:
                self.out(f"load_run<{stride}>({base} + std::ptrdiff_t(std::int32_t({at}[0])) * {stride} + {offset}, {name}{path});")
            else:
                self.out(f"gather<{stride}>({base} + {offset}, {at}, {name}{path});")

    def store_memory(self, value, pointer, mask):
        text, terms, type_, shared = self.address(pointer)
        explicit = not shared
        base = self.fresh("p")
        self.out(f"char* const {base} = {text};")
        if not terms:
            if not self.rep(value):
                for offset, t, path in self.leaves(type_, explicit):
                    self.out(f"store_one({base} + {offset}, {self.wrapped(self.uniform(value))}{path});")
            else:
                for offset, t, path in self.leaves(type_, explicit):
                    self.out(f"store_last({base} + {offset}, {self.wrapped(self.uniform(value))}{path}, {mask or 'kAll'});")
            return
        index, stride, c = self.index(terms)
        at = self.fresh("i")
        self.out(f"const vu {at} = {index};")
        v = self.fresh("v")
        self.out(f"const {self.cpp(type_, True)} {v} = {self.get(value, True)};")
        for offset, t, path in self.leaves(type_, explicit):
            if c in (ALIGNED, CONSECUTIVE) and mask is None:
                self.out(f"store_run<{stride}>({base} + std::ptrdiff_t(std::int32_t({at}[0])) * {stride} + {offset}, {v}{path});")
            elif c in (ALIGNED, CONSECUTIVE):
                self.out(f"store_run<{stride}>({base} + std::ptrdiff_t(std::int32_t({at}[0])) * {stride} + {offset}, {v}{path}, {mask});")
            else:
                self.out(f"scatter<{stride}>({base} + {offset}, {at}, {v}{path}, {mask or 'kAll'});")

    @staticmethod
    def wrapped(text):
        return text if text.replace("_", "").isalnum() else f"({text})"

    # local variables
    def local(self, pointer):
        """(C++ expression of what a pointer to a local variable points to, index expression of the one varying step or None, type)."""
        _, root, path, type_ = self.p.pointer(pointer)
        text, rest, varying_index, size = self.ident(root), "", None, 0
        for index in path:
            t = self.m.ids[type_]
            known = self.m.constant(index[0])
            if t.op == "TypeStruct":
                piece = f".m{known}"
            else:
                member = "v" if t.op == "TypeArray" else "c"
                if known is not None:
                    piece = f".{member}[{known}]"
                elif not self.rep(index):
                    piece = f".{member}[{self.uniform(index)}]"
                else:
                    if varying_index is not None:
                        fail(f"{self.m.path}: two indices that differ between lanes")
                    varying_index = self.uniform(index)
                    size = self.m.constant(t.args[1]) if t.op == "TypeArray" else t.args[1]
                    text, rest, piece = text + rest + f".{member}", "", ""
            type_ = self.p.part_type(type_, known if t.op == "TypeStruct" else 0)
            rest += piece
        return text, rest, varying_index, size, type_

    def home(self, key):
        """The scopes under masks that all accesses of a variable are in."""
        paths = [self.masks_of(a[2]) for a in self.p.accesses[key]]
        if any(a[3].kind in ("phi", "return") for a in self.p.accesses[key]):
            return None
        shared = paths[0]
        for p in paths[1:]:
            n = 0
            while n < min(len(p), len(shared)) and p[n] == shared[n]:
                n += 1
            shared = shared[:n]
        return shared

    def masks_of(self, path):
        return [s for s in path if self.p.is_divergent(s)]

    def store_local(self, n, mask):
        value = n.args[1]
        _, root, _, _ = self.p.pointer(n.args[0])
        text, rest, index, size, type_ = self.local(n.args[0])
        if not self.rep(root):
            self.out(f"{text}{rest} = {self.uniform(value)};")
            return
        new = self.get(value, True)
        home = self.home(root) if mask is not None else None
        if home and home == self.masks_of(n.path) and not self.p.carries(root, home):
            mask = None
        if index is not None:
            self.out(f"put_lanes<{size}>({text}, as_u({index}), {mask or 'kAll'}, [](auto& x) -> auto& {{ return x{rest}; }}, {new});")
        else:
            _, _, indices, pointed = self.p.pointer(n.args[0])
            steps, _ = self.p.steps(pointed, indices)
            self.assign(text + rest, new, self.p.at(self.p.class_of(root), steps), type_, mask)

    def assign(self, target, value, c, type_, mask):
        """Lanes under the mask take a value. What is not VARYING is the same, or in a row, for all that will read it: those lanes too that
        take no part hold it then, and any of them can be asked."""
        kinds = leaves(c)
        if mask is None or VARYING not in kinds:
            self.out(f"{target} = {value};")
        elif all(k == VARYING for k in kinds):
            self.out(f"{target} = select({mask}, {value}, {target});")
        else:
            held = self.fresh("v")
            self.out(f"const auto {held} = {value};")
            t = self.m.ids[type_]
            for i, part in enumerate(c):
                member = f".m{i}" if t.op == "TypeStruct" else f".c[{i}]"
                if t.op not in ("TypeStruct", "TypeVector"):
                    fail(f"{self.m.path}: an array of which lanes have different parts")
                self.assign(target + member, held + member, part, self.p.part_type(type_, i if t.op == "TypeStruct" else 0), mask)

    def load_local(self, n, name):
        _, root, path, _ = self.p.pointer(n.args[0])
        text, rest, index, size, type_ = self.local(n.args[0])
        if index is not None:
            self.out(f"const {self.cpp(type_, True)} {name} = get_lanes<{self.cpp(type_, True)}, {size}>({text}, as_u({index}), [](const auto& x) -> const auto& {{ return x{rest}; }});")
        elif self.rep(root) and not self.rep(n.key):
            self.out(f"const {self.cpp(type_, False)} {name} = first({text}{rest});")
        else:
            self.out(f"const {self.cpp(type_, self.rep(root))} {name} = {text}{rest};")

    # instructions
    def instruction(self, n, mask):
        inst, op = n.inst, n.inst.op
        if op == "Variable":
            varying = self.rep(n.key)
            # Lanes that take no part leave what was there, so something has to be; clearing large ones shows in profiles.
            large = self.m.ids[self.p.types[n.key]].op in ("TypeArray", "TypeStruct", "TypeMatrix")
            self.out(f"[[maybe_unused]] {self.cpp(self.p.types[n.key], varying)} {self.ident(n.key)}{'' if large else '{}'};")
            return
        if op in ("AccessChain", "InBoundsAccessChain", "MemoryBarrier", "Undef"):
            return
        if op == "ControlBarrier":
            self.out("barrier();")
            return
        if op == "Store":
            storage = self.p.pointer(n.args[0])[0]
            if storage == 7:
                self.store_local(n, mask)
            else:
                self.store_memory(n.args[1], n.args[0], mask)
            return
        name = self.ident(n.key)
        if op == "Load":
            storage, root, _, _ = self.p.pointer(n.args[0])
            if storage == 7:
                self.load_local(n, name)
            elif storage == 1:
                self.out(f"const {self.cpp(inst.type, self.rep(n.key))} {name} = {self.builtin(root, n.args[0])};")
            else:
                self.load_memory(name, n.args[0], mask)
            return
        if op.startswith("Atomic"):
            self.atomic(n, name, mask)
            return
        varying = self.rep(n.key)
        text, vector = self.expression(n, varying)
        if vector and not varying:
            text = f"first({text})"
        self.out(f"[[maybe_unused]] const {self.cpp(inst.type, varying)} {name} = {text};")

    def builtin(self, root, pointer):
        which = self.m.decorations[root[0]][11][0]
        if which == 29:
            return "lane"
        path = self.p.pointer(pointer)[2]
        component = self.m.constant(path[0][0]) if path else None
        if which == 26:  # WorkgroupId
            return "group" if component == 0 else "0u" if component is not None else fail("a builtin as a whole")
        if which == 24:
            return "1u" if component is not None else fail("a builtin as a whole")
        fail(f"{self.m.path}: builtin {which}")

    def atomic(self, n, name, mask):
        function = {"AtomicIAdd": "atomic_add", "AtomicUMax": "atomic_max", "AtomicOr": "atomic_or"}[n.inst.op]
        text, terms, _, shared = self.address(n.args[0])
        index, stride = "vu{}", 4
        if terms:
            index, stride, _ = self.index(terms)
        used = n.key in self.used
        self.out(f"[[maybe_unused]] const vu {name} = {function}<{stride}, {'true' if shared else 'false'}, {'true' if used else 'false'}>({text}, {index}, {self.get(n.args[3], True)}, {mask or 'kAll'});")

    def expression(self, n, varying):
        """(C++ of a pure operation, whether that is a vector although all lanes have the same)."""
        inst, op, args = n.inst, n.inst.op, n.args
        get = lambda i: self.get(args[i], varying)
        if op == "ExtInst":
            return f"{EXT[inst.args[1]]}({', '.join(self.get(a, varying) for a in args[2:])})", False
        if op in BINARY:
            return f"({get(0)} {BINARY[op]} {get(1)})", False
        if op in ("UDiv", "SDiv", "UMod", "SRem"):
            function = {"UDiv": "div_", "SDiv": "div_", "UMod": "mod_", "SRem": "mod_"}[op]
            if varying and not self.rep(args[1]) and self.m.ids[inst.type].op == "TypeInt":
                return f"{function}({get(0)}, {self.uniform(args[1])})", False
            return f"{function}({get(0)}, {get(1)})", False
        if op in COMPARE:
            return f"compare({get(0)}, {get(1)}, [](auto a, auto b) {{ return a {COMPARE[op]} b; }})", False
        if op == "LogicalNot":
            return f"not_({get(0)})", False
        if op == "LogicalEqual":
            return f"not_({get(0)} ^ {get(1)})", False
        if op == "LogicalNotEqual":
            return f"({get(0)} ^ {get(1)})", False
        if op in ("FNegate", "SNegate"):
            return f"(-{get(0)})", False
        if op == "Not":
            return f"(~{get(0)})", False
        if op in ("ShiftLeftLogical", "ShiftRightLogical", "ShiftRightArithmetic"):
            return f"shift_{'left' if op == 'ShiftLeftLogical' else 'right'}({get(0)}, {get(1)})", False
        if op == "Select":
            return f"select({get(0)}, {get(1)}, {get(2)})", False
        if op in ("ConvertFToU", "ConvertFToS", "ConvertSToF", "ConvertUToF"):
            return f"convert<{self.cpp(inst.type, varying)}>({get(0)})", False
        if op == "Bitcast":
            if self.m.ids[inst.type].op == "TypePointer" or self.m.ids[self.p.type_of(args[0])].op == "TypePointer":
                return get(0), False
            return f"bits<{self.cpp(inst.type, varying)}>({get(0)})", False
        if op in ("CopyObject", "CopyLogical"):
            return get(0), False
        if op in ("VectorTimesScalar", "MatrixTimesScalar"):
            return f"scale({get(0)}, {get(1)})", False
        if op in ("MatrixTimesVector", "OuterProduct", "Dot", "Any", "All"):
            function = {"MatrixTimesVector": "times", "OuterProduct": "outer", "Dot": "dot_", "Any": "any_of", "All": "all_of"}[op]
            return f"{function}({', '.join(get(i) for i in range(len(args)))})", False
        if op == "CompositeConstruct":
            t = self.m.ids[inst.type]
            cpp = self.cpp(inst.type, varying)
            parts = []
            for a in args:
                if t.op == "TypeVector" and self.m.ids[self.p.type_of(a)].op == "TypeVector":
                    parts += [f"{self.wrapped(self.get(a, varying))}.c[{i}]" for i in range(self.m.ids[self.p.type_of(a)].args[1])]
                else:
                    parts.append(self.get(a, varying))
            return f"{cpp}{{{', '.join(parts)}}}" if t.op == "TypeStruct" else f"{cpp}{{{{{', '.join(parts)}}}}}", False
        if op == "CompositeExtract":
            type_, text = self.p.type_of(args[0]), self.wrapped(self.uniform(args[0]))
            for index in inst.args[1:]:
                t = self.m.ids[type_]
                text += f".m{index}" if t.op == "TypeStruct" else f".v[{index}]" if t.op == "TypeArray" else f".c[{index}]"
                type_ = self.p.part_type(type_, index if t.op == "TypeStruct" else 0)
            return text, self.rep(args[0]) and not varying
        if op == "VectorShuffle":
            first = self.m.ids[self.p.type_of(args[0])].args[1]
            parts = []
            for i in inst.args[2:]:
                source, k = (args[0], i) if i < first else (args[1], i - first)
                part = f"{self.wrapped(self.get(source, varying or self.rep(source)))}.c[{k}]"
                parts.append(f"first({part})" if self.rep(source) and not varying else part)
            return f"{self.cpp(inst.type, varying)}{{{{{', '.join(parts)}}}}}", False
        if op == "VectorExtractDynamic":
            return f"{self.wrapped(get(0))}.c[{self.uniform(args[1])}]", False
        fail(f"{self.m.path}: {op} is not known")

    # control
    def block(self, nodes, mask):
        """Writes nodes under a mask (a C++ variable; None: all lanes)."""
        for n in nodes:
            if n.kind == "inst":
                self.instruction(n, mask)
            elif n.kind == "phi":
                self.take(n, mask)
            elif n.kind == "if":
                self.branch(n, mask)
            elif n.kind == "rest":
                self.rest(n, mask)
            elif n.kind == "loop":
                self.loop(n, mask)
            elif n.kind == "call":
                self.inline(n, mask)
            elif n.kind in ("break", "continue"):
                self.leave(n, mask)
            elif n.kind == "return":
                self.give_back(n, mask)

    def take(self, n, mask):
        """A value that depends on where control came from."""
        varying = self.rep(n.id)
        value = self.get(n.value, varying)
        # The header's own value is written first, for all lanes; each branch then writes that of its lanes.
        self.assign(self.ident(n.id), value, self.p.class_of(n.id), n.type, mask if varying else None)

    def declare_phis(self, nodes, done):
        """The values that are taken inside `nodes` are declared before them."""
        for n in nodes:
            if n.kind == "phi" and n.id not in done:
                done.add(n.id)
                self.out(f"[[maybe_unused]] {self.cpp(n.type, self.rep(n.id))} {self.ident(n.id)}{{}};")
            for attribute in ("then", "other", "body", "tail"):
                if hasattr(n, attribute) and n.kind != "call":
                    self.declare_phis(getattr(n, attribute), done)

    def scope(self, head, nodes, mask):
        self.out(head + "{")
        self.depth += 1
        self.block(nodes, mask)
        self.depth -= 1
        self.out("}")

    def branch(self, n, mask):
        if not n.then and not n.other:
            return
        if not self.rep(n.cond):
            text = self.uniform(n.cond)
            if n.then:
                self.scope(f"if ({text}) ", n.then, mask)
                if n.other:
                    self.scope("else ", n.other, mask)
            else:
                self.scope(f"if (!({text})) ", n.other, mask)
            return
        yes, no = self.fresh("m"), self.fresh("m")
        condition = self.uniform(n.cond)
        if n.then:
            self.out(f"const vm {yes} = " + (f"{mask} & {condition};" if mask else f"{condition};"))
        if n.other:
            self.out(f"const vm {no} = " + (f"{mask} & ~{condition};" if mask else f"~{condition};"))
        if n.then:
            self.scope(f"if (any({yes})) ", n.then, yes)
        if n.other:
            self.scope(f"if (any({no})) ", n.other, no)

    def rest(self, n, mask):
        if not any(e in self.p.masked for e in n.exits):
            self.block(n.body, mask)
            return
        gone = [self.exit_mask[e] for e in sorted(n.exits, key=str) if e in self.p.masked]
        left = self.fresh("m")
        terms = " & ".join(f"~{g}" for g in gone)
        self.out(f"const vm {left} = {mask + ' & ' if mask else ''}{terms};")
        self.scope(f"if (any({left})) ", n.body, left)

    def leave(self, n, mask):
        exit_ = (n.kind, id(n.loop))
        if exit_ in self.p.masked:
            self.out(f"{self.exit_mask[exit_]} |= {mask or 'kAll'};")
        else:
            label = f"{n.kind}_{n.loop.label}"
            self.labels.add(label)
            self.out(f"goto {label};")

    def give_back(self, n, mask):
        exit_ = ("return", n.call)
        if n.value is not None:
            varying = self.rep(n.result)
            value = self.get(n.value, varying)
            self.assign(self.ident(n.result), value, self.p.class_of(n.result), self.p.types[n.result], mask if varying else None)
        if exit_ in self.p.masked:
            self.out(f"{self.exit_mask[exit_]} |= {mask or 'kAll'};")
        elif not self.last_return.get(id(n)):
            label = self.return_label[n.call]
            self.labels.add(label)
            self.out(f"goto {label};")

    def loop(self, n, mask):
        n.label = self.fresh("")
        broken, continued = ("break", id(n)), ("continue", id(n))
        divergent = any(e in self.p.masked for e in n.exits)
        self.declare_phis(n.body + n.tail, set())
        if not divergent:
            count = self.trip_count(n) if n.unroll else None
            if count is not None:
                for _ in range(count):
                    n.label = self.fresh("")
                    self.scope("", n.body, mask)
                    if f"continue_{n.label}" in self.labels:
                        self.out(f"continue_{n.label}:;")
                    self.scope("", n.tail, mask)
                    if f"break_{n.label}" in self.labels:
                        self.out(f"break_{n.label}:;")
                return
            self.out("for (;;) {")
            self.depth += 1
            self.scope("", n.body, mask)
            if f"continue_{n.label}" in self.labels:
                self.out(f"continue_{n.label}:;")
            self.block(n.tail, mask)
            self.depth -= 1
            self.out("}")
            if f"break_{n.label}" in self.labels:
                self.out(f"break_{n.label}:;")
            return
        gone, waits = self.fresh("gone"), self.fresh("waits")
        self.exit_mask[broken], self.exit_mask[continued] = gone, waits
        outer = [self.exit_mask[e] for e in n.exits if e in self.p.masked and e not in (broken, continued)]
        self.out(f"vm {gone} = {'~' + mask if mask else 'vm{}'};")
        self.out("for (;;) {")
        self.depth += 1
        active = self.fresh("m")
        self.out(f"vm {waits}{{}};")
        self.out(f"const vm {active} = ~{gone}" + "".join(f" & ~{o}" for o in outer) + ";")
        self.out(f"if (!any({active})) break;")
        self.scope("", n.body, active)
        tail = self.fresh("m")
        if n.tail:
            self.out(f"[[maybe_unused]] const vm {tail} = ~{gone}" + "".join(f" & ~{o}" for o in outer) + ";")
            self.scope(f"if (any({tail})) ", n.tail, tail)
        self.out(f"(void){waits};")
        self.depth -= 1
        self.out("}")

    def trip_count(self, n):
        """How often a loop runs that counts a variable from one constant to another and is left nowhere else; None: not known."""
        ops = [x.inst.op for x in n.body if x.kind == "inst"]
        if [x.inst.op for x in n.tail if x.kind == "inst"] != ["Load", "IAdd", "Store"] or len(n.tail) != 3 or ops[:1] != ["Load"]:
            return None
        if self.exits_of(n) != 1:
            return None
        load, add, store = n.tail
        counter = self.p.pointer(store.args[0])[1]
        compare = n.body[1] if len(n.body) > 2 and n.body[1].kind == "inst" else None
        if compare is None or compare.inst.op not in ("ULessThan", "SLessThan") or n.body[2].kind != "if":
            return None
        if self.p.pointer(n.body[0].args[0])[1] != counter or self.p.pointer(load.args[0])[1] != counter:
            return None
        end, step = self.m.constant(compare.args[1][0]), self.m.constant(add.args[1][0])
        stores = [a[3] for a in self.p.accesses[counter] if a[0] == "store" and a[3] is not store]
        if len(stores) != 1 or end is None or step is None or step < 1:
            return None
        start = self.m.constant(stores[0].args[1][0])
        count = None if start is None else max(0, -(-(end - start) // step))
        return count if count is not None and count <= 32 else None

    def exits_of(self, n):
        def count(nodes):
            total = 0
            for x in nodes:
                total += x.kind == "break" and x.loop is n
                total += x.kind == "return"
                for attribute in ("then", "other", "body", "tail"):
                    if hasattr(x, attribute) and x.kind != "call":
                        total += count(getattr(x, attribute))
            return total
        return count(n.body) + count(n.tail)

    def inline(self, n, mask):
        exit_ = ("return", n.number)
        if n.result is not None:
            self.out(f"[[maybe_unused]] {self.cpp(self.p.types[n.result], self.rep(n.result))} {self.ident(n.result)}{{}};")
        if exit_ in self.p.masked:
            self.exit_mask[exit_] = self.fresh("returned")
            self.out(f"vm {self.exit_mask[exit_]}{{}};")
        label = self.return_label[n.number] = f"return_{n.number}_{self.fresh('')}"
        if n.body and n.body[-1].kind == "return":
            self.last_return[id(n.body[-1])] = True
        self.declare_phis(n.body, set())
        self.scope("", n.body, mask)
        if label in self.labels:
            self.out(f"{label}:;")

    def write(self):
        self.exit_mask, self.last_return, self.return_label = {}, {}, {}
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
                cpp = self.cpp(self.m.ids[v.type].args[1], False)
                shared.append(f"[[maybe_unused]] alignas(64) thread_local {cpp} shared_{v.id};")
        barriers = any(n.inst.op == "ControlBarrier" for n in self.p.insts)
        outer = f"lanes{self.p.width}"
        text = f"namespace {self.name} {{\nnamespace {{\nusing {outer}::select;\nusing {outer}::vary;\n" + "\n".join(self.struct_text) + "\n"
        text += self.conversions()
        text += "\n".join(shared) + "\n}\n"
        text += "void run([[maybe_unused]] const std::byte* arguments) {\n  [[maybe_unused]] const vu lane = lanes_from(invocation.thread);\n"
        text += "  [[maybe_unused]] const std::uint32_t group = invocation.group;\n"
        text += "\n".join(self.lines) + "\n}\n}\n"
        return text, barriers

    def conversions(self):
        """vary() and select() of the structs that are there both ways."""
        out = []
        for key, name in list(self.structs.items()):
            members = range(len(key))
            if all(self.has_lanes(k) for k in key):
                parts = ", ".join(f"select(m, a.m{i}, b.m{i})" for i in members)
                out.append(f"[[maybe_unused]] inline {name} select(vm m, const {name}& a, const {name}& b) {{ return {{{parts}}}; }}")
            uniform = tuple(self.as_uniform(k) for k in key)
            if uniform != key and uniform in self.structs:
                parts = ", ".join(f"vary(a.m{i})" for i in members)
                out.append(f"[[maybe_unused]] inline {name} vary(const {self.structs[uniform]}& a) {{ return {{{parts}}}; }}")
        return "\n".join(out) + "\n"

    def has_lanes(self, cpp):
        if cpp in SCALARS:
            return True
        if cpp.startswith(("vec<", "arr<")):
            return self.has_lanes(cpp[4:cpp.rindex(",")])
        for key, name in self.structs.items():
            if name == cpp:
                return all(self.has_lanes(k) for k in key)
        return False

    def as_uniform(self, cpp):
        if cpp in SCALARS:
            return SCALARS[cpp]
        if cpp.startswith(("vec<", "arr<")):
            cut = cpp.rindex(",")
            return cpp[:4] + self.as_uniform(cpp[4:cut]) + cpp[cut:]
        for key, name in self.structs.items():
            if name == cpp:
                return self.structs.get(tuple(self.as_uniform(k) for k in key), cpp)
        return cpp

"""A kernel as C++ in the words of lanes.h and lane_memory.h."""
from expressions import INTEGERS, Expressions, fold, pick
from parts import Leaf, Types, as_lanes, each, first, vary
from spirv import fail
from uniformity import ALIGNED, COMPONENT, CONSECUTIVE, QUARTER, VARYING, is_uniform

LARGEST_UNROLLED = 32


def each_number(tree, value):
    """A tree of the same shape, with one value everywhere."""
    return [each_number(x, value) for x in tree] if isinstance(tree, list) else value


class Writer:
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

    # addresses
    def address(self, key):
        """(uniform address as an expression, list of varying (index key, stride, class), type, is shared memory)."""
        storage, root, path, type_ = self.p.pointer(key)
        explicit = storage in (5349, 9)
        if storage == 9:
            base = "const_cast<char*>(reinterpret_cast<const char*>(arguments))"
        elif storage == 5349:
            leaf = self.tree(root)
            if leaf.varying:
                fail(f"{self.m.path}: an address that differs between lanes")
            base = leaf.text
        else:
            base = f"reinterpret_cast<char*>(shared_{root[0]})"
        offset, terms, uniform_terms = 0, [], []
        for index in path:
            t = self.kinds.of(type_)
            known = self.number(index)
            if t.op == "TypeStruct":
                offset += self.m.member_offsets[type_, known] if explicit else 4 * sum(map(self.kinds.words, t.args[:known]))
                self.matrix_stride = self.m.matrix_strides.get((type_, known), 16)
                type_ = t.args[known]
                continue
            stride = self.stride(type_, explicit)
            type_ = t.args[0]
            if known is not None:
                offset += known * stride
            elif self.differs(index):
                terms.append((index, stride, self.p.class_of(index)))
            else:
                uniform_terms.append(f"std::size_t({first(self.tree(index))}) * {stride}")
        text = " + ".join([base] + uniform_terms + ([str(offset)] if offset else []))
        return text, terms, type_, storage == 4

    def stride(self, type_, explicit):
        """Bytes from one part of an array, matrix or vector to the next."""
        t = self.kinds.of(type_)
        if not explicit:
            return 4 * self.kinds.words(t.args[0])
        return self.m.decorations[type_][6][0] if t.op in ("TypeArray", "TypeRuntimeArray") else self.matrix_stride if t.op == "TypeMatrix" else 4

    def index(self, terms):
        """(terms of the index as (key, factor), stride, class) of varying terms of an address."""
        if len(terms) == 1:
            index, stride, c = terms[0]
            return [(index, 1)], stride, c
        step = terms[0][1]
        for _, stride, _ in terms[1:]:
            while stride:
                step, stride = stride, step % stride
        in_a_row = sorted((s, c) for _, s, c in terms) == [(4, COMPONENT), (16, QUARTER)]
        return [(i, s // step) for i, s, _ in terms], step, CONSECUTIVE if in_a_row else VARYING

    def index_of_lanes(self, terms):
        return " + ".join(f"as_u({self.tree(key).text})" + (f" * {factor}u" if factor != 1 else "") for key, factor in terms)

    def index_of_first(self, terms):
        """The first lane's index as a scalar."""
        return " + ".join(self.first_lane(key, 4) + (f" * {factor}u" if factor != 1 else "") for key, factor in terms)

    def first_lane(self, key, depth):
        """An integer's value in the first lane, of scalars alone as far as it can be: only that is asked for where lanes read words in a row."""
        if not self.differs(key):
            return f"std::uint32_t({first(self.tree(key))})"
        maker = self.makers.get(key)
        sign = {"IAdd": "+", "ISub": "-", "IMul": "*"}.get(maker.inst.op) if maker is not None else None
        if sign is None or depth == 0:
            return f"as_u({self.tree(key).text})[0]"
        return f"({self.first_lane(maker.args[0], depth - 1)} {sign} {self.first_lane(maker.args[1], depth - 1)})"

    def fields(self, type_, explicit, offset=0):
        """Tree of the offsets of a type's scalars in memory, and of None for what lies in a vector of four words but first."""
        t = self.kinds.of(type_)
        if self.kinds.is_scalar(type_):
            return offset
        if t.op == "TypeStruct":
            out, at = [], 0
            for i, x in enumerate(t.args):
                self.matrix_stride = self.m.matrix_strides.get((type_, i), 16)
                out.append(self.fields(x, explicit, offset + (self.m.member_offsets[type_, i] if explicit else at)))
                at += 4 * self.kinds.words(x)
            return out
        if t.op == "TypeVector":
            return [offset + 4 * i for i in range(t.args[1])]
        stride = self.stride(type_, explicit)
        return [self.fields(t.args[0], explicit, offset + i * stride) for i in range(len(self.kinds.parts(type_)))]

    def is_four(self, type_):
        t = self.kinds.of(type_)
        return t.op == "TypeVector" and t.args[1] == 4

    # memory
    def load_memory(self, key, pointer, mask):
        text, terms, type_, shared = self.address(pointer)
        base = self.fresh("p")
        self.out(f"char* const {base} = {text};")
        fields = self.fields(type_, not shared)
        if not terms:
            self.define(key, type_, self.texts(type_, fields, lambda t, o: f"load_one<{self.kinds.scalar(t, False)}>({base} + {o})"), each_number(fields, False))
            return
        terms, stride, c = self.index(terms)
        # Lanes that take no part read what lies beside the others: words there is room for, larger steps not.
        run = c in (ALIGNED, CONSECUTIVE) and (mask is None or stride == 4)
        at = self.fresh("i")
        if run:
            self.out(f"char* const {at} = {base} + std::ptrdiff_t(std::int32_t({self.index_of_first(terms)})) * {stride};")
        else:
            self.out(f"const vu {at} = {'(' if mask else ''}{self.index_of_lanes(terms)}{f') & as_u({mask})' if mask else ''};")
        if key not in self.used:
            # Read for nothing: whoever writes that wants it near when it is read for good.
            self.out(f"ask_for({at});" if run else f"ask_for_lanes<{stride}>({base}, {at});")
            self.trees[key] = self.kinds.zeros(type_)
            return

        def load(t, offsets, name):
            if self.kinds.is_scalar(t):
                cpp = self.kinds.scalar(t, True)
                call = f"load_run<{cpp}, {stride}>({at} + {offsets})" if run else f"gather<{cpp}, {stride}>({base} + {offsets}, {at})"
                self.out(f"[[maybe_unused]] const {cpp} {name} = {call};")
                return Leaf(name, True)
            names = [f"{name}_{i}" for i in range(len(offsets))]
            if self.is_four(t):
                cpp = self.kinds.scalar(self.kinds.parts(t)[0], True)
                self.out(f"[[maybe_unused]] {cpp} {', '.join(names)};")
                where = f"{at} + {offsets[0]}" if run else f"{base} + {offsets[0]}, {at}"
                self.out(f"{'load_run' if run else 'gather'}_four<{stride}>({where}, {', '.join(names)});")
                return [Leaf(x, True) for x in names]
            return [load(part, o, x) for part, o, x in zip(self.kinds.parts(t), offsets, names)]
        self.trees[key] = load(type_, fields, self.stem(key))

    def texts(self, type_, offsets, f):
        if self.kinds.is_scalar(type_):
            return f(type_, offsets)
        return [self.texts(t, o, f) for t, o in zip(self.kinds.parts(type_), offsets)]

    def store_memory(self, value, pointer, mask):
        text, terms, type_, shared = self.address(pointer)
        base = self.fresh("p")
        self.out(f"char* const {base} = {text};")
        fields, tree = self.fields(type_, not shared), self.tree(value)
        if not terms:
            self.store_one(base, fields, tree, mask)
            return
        terms, stride, c = self.index(terms)
        run = c in (ALIGNED, CONSECUTIVE)
        at = self.fresh("i")
        if run:
            self.out(f"char* const {at} = {base} + std::ptrdiff_t(std::int32_t({self.index_of_first(terms)})) * {stride};")
        else:
            self.out(f"const vu {at} = {self.index_of_lanes(terms)};")

        under = f", {mask}" if mask else ""

        def store(t, offsets, part):
            where = (lambda o: f"{at} + {o}") if run else (lambda o: f"{base} + {o}, {at}")
            function = "store_run" if run else "scatter"
            if self.kinds.is_scalar(t):
                self.out(f"{function}<{stride}>({where(offsets)}, {vary(part)}{under});")
            elif self.is_four(t):
                self.out(f"{function}_four<{stride}>({where(offsets[0])}, {', '.join(vary(x) for x in part)}{under});")
            else:
                for x in zip(self.kinds.parts(t), offsets, part):
                    store(*x)
        store(type_, fields, tree)

    def store_one(self, base, fields, tree, mask):
        """All lanes store to one place: the last one's stays."""
        if isinstance(tree, Leaf):
            self.out(f"store_last({base} + {fields}, {tree.text}, {mask or 'kAll'});" if tree.varying else f"store_one({base} + {fields}, {tree.text});")
            return
        # A value that only some lanes have is stored as a whole by the same lane.
        for o, part in zip(fields, tree):
            self.store_one(base, o, part, mask)

    def atomic(self, n, mask):
        function = {"AtomicIAdd": "atomic_add", "AtomicUMax": "atomic_max", "AtomicOr": "atomic_or"}[n.inst.op]
        text, terms, _, shared = self.address(n.args[0])
        index, stride = "vu{}", 4
        if terms:
            terms, stride, _ = self.index(terms)
            index = self.index_of_lanes(terms)
        used = "true" if n.key in self.used else "false"
        call = f"{function}<{stride}, {'true' if shared else 'false'}, {used}>({text}, {index}, {vary(self.tree(n.args[3]))}, {mask or 'kAll'})"
        self.define(n.key, n.inst.type, call, True)

    # local variables
    def place(self, pointer, at=None):
        """(tree of what a pointer to a local variable points to, the index that differs between lanes or None, number of parts that it may name).
        at: a number for that index."""
        _, root, path, type_ = self.p.pointer(pointer)
        tree, varying, count = self.trees[root], None, 0
        for index in path:
            known = self.number(index)
            if known is None and self.differs(index):
                if varying is not None:
                    fail(f"{self.m.path}: two indices that differ between lanes")
                varying, count, known = index, len(tree), at or 0
            if known is not None:
                tree = tree[min(known, len(tree) - 1)]  # beyond only in code that is never reached
            else:
                tree = self.at_run_time(tree, first(self.tree(index)), root)
        return tree, varying, count

    def at_run_time(self, tree, index, root):
        """The part of a C++ array that an expression names."""
        if len(tree) == 1:
            return tree[0]

        def change(a, b):
            # The two differ in one index only: that of the part.
            end = next((i for i, (x, y) in enumerate(zip(a.text, b.text)) if x != y), None)
            if end is None or a.text[end - 1] != "[":
                fail(f"{self.m.path}: {self.stem(root)} is indexed by what is not known while translating")
            return Leaf(a.text[:end] + index + a.text[a.text.index("]", end):], a.varying)
        return each(change, tree[0], tree[1])

    def masks_of(self, path):
        return [s for s in path if self.p.is_divergent(s)]

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

    def store_local(self, n, mask):
        _, root, path, pointed = self.p.pointer(n.args[0])
        target, index, count = self.place(n.args[0])
        value = self.tree(n.args[1])
        home = self.home(root) if mask is not None else None
        if home and home == self.masks_of(n.path) and not self.p.carries(root, home):
            mask = None
        steps, type_ = self.p.steps(pointed, path)
        if index is None:
            self.assign(target, value, self.p.at(self.p.class_of(root), steps), type_, mask)
            return
        lanes = self.tree(index).text
        for i in range(count):
            here = self.fresh("m")
            self.out(f"const vm {here} = {mask + ' & ' if mask else ''}vm{{(vi)(as_u({lanes}) == {i}u)}};")
            each(lambda t, v: self.out(f"{t.text} = select({here}, {vary(v)}, {t.text});"), self.place(n.args[0], i)[0], value)

    def assign(self, target, value, c, type_, mask):
        """Lanes under the mask take a value. What is not VARYING is the same, or in a row, for all that will read it: those lanes too that
        take no part hold it then, and any of them can be asked."""
        if isinstance(target, Leaf):
            text = as_lanes(value, target.varying)
            if mask is not None and c == VARYING:
                text = f"select({mask}, {text}, {target.text})"
            self.out(f"{target.text} = {text};")
            return
        for parts in zip(target, value, self.kinds.part_classes(type_, c), self.kinds.parts(type_)):
            self.assign(*parts, mask)

    def load_local(self, n):
        _, root, _, _ = self.p.pointer(n.args[0])
        if root in self.counting:
            self.known[n.key] = self.counting[root]
            self.trees[n.key] = self.kinds.number(n.inst.type, self.counting[root])
            return
        tree, index, count = self.place(n.args[0])
        wanted = self.wanted(n.inst.type, self.p.class_of(n.key))
        if index is None:
            texts = each(as_lanes, tree, wanted)
        else:
            parts = [self.place(n.args[0], i)[0] for i in range(count)]
            lanes = self.tree(index)
            texts = each(lambda w, *leaves: pick(leaves, lanes, w), wanted, *parts)
        self.define(n.key, n.inst.type, texts, wanted)

    def find_indexed(self):
        """What has to be a C++ array: of a local variable, the kinds of composites whose parts are picked by a number that is not known while translating."""
        counters = {}

        def loops(nodes):
            for n in nodes:
                if n.kind == "loop" and self.unrolled(n) is not None:
                    counters[self.counter(n)] = True
                for attribute in ("then", "other", "body", "tail"):
                    if hasattr(n, attribute):
                        loops(getattr(n, attribute))
        loops([self.p.tree])

        def will_be_known(key):
            if key not in self.p.types:
                return self.m.constant(key[0]) is not None
            n = self.makers.get(key)
            if n is None:
                return False
            if n.inst.op == "Load":
                storage, root, path, _ = self.p.pointer(n.args[0])
                return storage == 7 and root in counters and not path
            return n.inst.op in INTEGERS and all(will_be_known(a) for a in n.args)

        self.indexed = {}
        for n in self.p.insts:
            if n.inst.op not in ("Load", "Store"):
                continue
            storage, root, path, type_ = self.p.pointer(n.args[0])
            if storage != 7:
                continue
            for index in path:
                t = self.kinds.of(type_)
                if t.op == "TypeStruct":
                    type_ = t.args[self.m.constant(index[0])]
                    continue
                if not will_be_known(index) and not self.differs(index):
                    self.indexed.setdefault(root, set()).add(t.op)
                type_ = t.args[0]

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
        # The header's own value is written first, for all lanes; each branch then writes that of its lanes.
        self.assign(self.trees[n.id], self.tree(n.value), self.p.class_of(n.id), n.type, mask)

    def declare_phis(self, nodes, done):
        """The values that are taken inside `nodes` are declared before them."""
        for n in nodes:
            if n.kind == "phi" and n.id not in done:
                done.add(n.id)
                self.declare(n.id, n.type)
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
        condition = self.tree(n.cond)
        if self.number(n.cond) is not None:
            self.block(n.then if self.number(n.cond) else n.other, mask)
            return
        if not condition.varying:
            text = condition.text
            if n.then:
                self.scope(f"if ({text}) ", n.then, mask)
                if n.other:
                    self.scope("else ", n.other, mask)
            else:
                self.scope(f"if (!({text})) ", n.other, mask)
            return
        yes, no = self.fresh("m"), self.fresh("m")
        if n.then:
            self.out(f"const vm {yes} = " + (f"{mask} & {condition.text};" if mask else f"{condition.text};"))
        if n.other:
            self.out(f"const vm {no} = " + (f"{mask} & ~{condition.text};" if mask else f"~{condition.text};"))
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
            self.assign(self.trees[n.result], self.tree(n.value), self.p.class_of(n.result), self.p.types[n.result], mask)
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
            numbers = self.unrolled(n)
            if numbers is not None:
                outside = dict(self.known)
                for i in numbers:
                    self.counting[self.counter(n)] = i
                    n.label = self.fresh("")
                    self.scope("", n.body, mask)
                    if f"continue_{n.label}" in self.labels:
                        self.out(f"continue_{n.label}:;")
                del self.counting[self.counter(n)]
                self.known = outside
                after = self.trees[self.counter(n)]
                self.out(f"{after.text} = {as_lanes(Leaf(str(numbers.stop), False), False) if not after.varying else self.kinds.scalar(self.p.types[self.counter(n)], True) + '{} + ' + str(numbers.stop)};")
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

    def counter(self, n):
        """The variable that a loop's tail adds to."""
        return self.p.pointer(n.tail[2].args[0])[1]

    def unrolled(self, n):
        """The numbers that a loop's counter takes if the loop is written out: one that counts from one constant to another and is left nowhere else."""
        if not n.unroll or any(e in self.p.masked for e in n.exits) or self.exits_of(n) != 1:
            return None
        ops = [x.inst.op for x in n.body if x.kind == "inst"]
        if [x.inst.op for x in n.tail if x.kind == "inst"] != ["Load", "IAdd", "Store"] or len(n.tail) != 3 or ops[:1] != ["Load"]:
            return None
        load, add, _ = n.tail
        counter = self.counter(n)
        compare = n.body[1] if len(n.body) > 2 and n.body[1].kind == "inst" else None
        if compare is None or compare.inst.op not in ("ULessThan", "SLessThan") or n.body[2].kind != "if":
            return None
        if self.p.pointer(n.body[0].args[0])[1] != counter or self.p.pointer(load.args[0])[1] != counter:
            return None
        end, step = self.m.constant(compare.args[1][0]), self.m.constant(add.args[1][0])
        stores = [a[3] for a in self.p.accesses[counter] if a[0] == "store" and a[3] is not n.tail[2]]
        if len(stores) != 1 or end is None or step is None or step < 1:
            return None
        start = self.m.constant(stores[0].args[1][0])
        if start is None or -(-(end - start) // step) > LARGEST_UNROLLED:
            return None
        return range(start, end, step)

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
            self.declare(n.result, self.p.types[n.result])
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
        barriers = any(n.inst.op == "ControlBarrier" for n in self.p.insts)
        text = f"namespace {self.name} {{\nnamespace {{\n" + "\n".join(shared) + "\n}\n"
        text += "void run([[maybe_unused]] const std::byte* arguments) {\n  [[maybe_unused]] const vu lane = lanes_from(invocation.thread);\n"
        text += "  [[maybe_unused]] const std::uint32_t group = invocation.group;\n"
        text += "\n".join(self.lines) + "\n}\n}\n"
        return text, barriers

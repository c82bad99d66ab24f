"""The C++ of loads, stores and atomics: addresses, and whether lanes read words in a row."""
from parts import Leaf, first, vary
from spirv import fail
from uniformity import ALIGNED, COMPONENT, CONSECUTIVE, EIGHTS, QUARTER, VARYING

# Operations on words that the first lane's scalar can go through; a remainder of a number other than zero alone.
IN_ONE_LANE = {"IAdd": "+", "ISub": "-", "IMul": "*", "UMod": "%", "ShiftRightLogical": ">>", "BitwiseAnd": "&"}


def each_number(tree, value):
    """A tree of the same shape, with one value everywhere."""
    return [each_number(x, value) for x in tree] if isinstance(tree, list) else value


class MemoryWriter:
    """Part of Writer (write_cpp.py)."""

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
        return " + ".join(self.first_lane(key, 6) + (f" * {factor}u" if factor != 1 else "") for key, factor in terms)

    def first_lane(self, key, depth):
        """An integer's value in the first lane, of scalars alone as far as it can be: only that is asked for where lanes read words in a row."""
        if not self.differs(key):
            return f"std::uint32_t({first(self.tree(key))})"
        maker = self.makers.get(key)
        sign = IN_ONE_LANE.get(maker.inst.op) if maker is not None else None
        if sign is None or depth == 0 or (sign == "%" and not self.number(maker.args[1])):
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
        eights = c == EIGHTS and stride == 4 and self.kinds.is_scalar(type_)
        at = self.fresh("i")
        if run:
            self.out(f"char* const {at} = {base} + std::ptrdiff_t(std::int32_t({self.index_of_first(terms)})) * {stride};")
        elif eights:
            self.out(f"const vu {at} = {self.index_of_lanes(terms)};")
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
                if eights:
                    call = f"load_eights<{cpp}>({base} + {offsets}, {at}, {mask or 'kAll'})"
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
        function = {"AtomicIAdd": "atomic_add", "AtomicUMax": "atomic_max", "AtomicOr": "atomic_or",
                    "AtomicCompareExchange": "atomic_exchange_if"}[n.inst.op]
        # Scope and semantics come before them: one of each, but two semantics for a comparison.
        operands = n.args[4:] if n.inst.op == "AtomicCompareExchange" else n.args[3:]
        values = ", ".join(vary(self.tree(operand)) for operand in operands)
        text, terms, _, shared = self.address(n.args[0])
        index, stride = "vu{}", 4
        if terms:
            terms, stride, _ = self.index(terms)
            index = self.index_of_lanes(terms)
        used = "true" if n.key in self.used else "false"
        call = f"{function}<{stride}, {'true' if shared else 'false'}, {used}>({text}, {index}, {values}, {mask or 'kAll'})"
        self.define(n.key, n.inst.type, call, True)

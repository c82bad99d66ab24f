"""The C++ of a kernel's own variables, under masks where lanes part."""
from expressions import INTEGERS, pick
from parts import Leaf, as_lanes, each, first, vary
from spirv import fail
from uniformity import VARYING


class LocalsWriter:
    """Part of Writer (write_cpp.py)."""

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

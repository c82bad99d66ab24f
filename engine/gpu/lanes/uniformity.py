"""Which values all lanes have in common."""
from spirv import BINARY, COMPARE
from structure import Structurer, exits_in, nest_rests

# A value over the lanes: one; u + lane where u is a multiple of the width; u + lane; anything; u + v / 4 and v % 4 where v is a multiple of the width + lane, which
# together tell components of vectors that lie side by side. Of 16 lanes: one value for lanes 0 to 7 and one for 8 to 15; such a value + lane % 8.
UNIFORM, ALIGNED, CONSECUTIVE, VARYING, QUARTER, COMPONENT, HALVES, EIGHTS = 0, 1, 2, 3, 4, 5, 6, 7


def leaves(c):
    return [c] if isinstance(c, int) else [x for y in c for x in leaves(y)]


def join(a, b):
    if isinstance(a, int):
        return a if a == b else VARYING
    return [join(x, y) for x, y in zip(a, b)]


def is_uniform(c):
    return all(x == UNIFORM for x in leaves(c))


class Program:
    """One kernel: a tree of all its calls, and what is known of every value."""

    def __init__(self, module, width):
        self.m, self.width = module, width
        self.types, self.classes = {}, {}  # of a value by its key (id, number of the call)
        for f in module.functions.values():
            f["ids"] = {p.id for p in f["params"]} | {i.id for b in f["blocks"].values() for i in b if i.id is not None}
        entry = module.functions[module.entry]
        self.tree = Structurer(module, entry, [], self).tree()
        self.tree.body = nest_rests(self.tree.body)
        self.analyse()

    def value(self, type_, key):
        self.types[key] = type_
        return key

    def call(self, caller, inst):
        callee = self.m.functions[inst.args[0]]
        node = Structurer(self.m, callee, [caller.name(a) for a in inst.args[1:]], self).tree()
        if node.result is not None:
            caller.own[inst.id] = node.result
        return node

    # types
    def t(self, id_):
        return self.m.ids[id_]

    def filled(self, type_, c):
        """A class for a value of a type, all its parts being `c`."""
        t = self.t(type_)
        if t.op == "TypeVector":
            return [c] * t.args[1]
        if t.op == "TypeStruct":
            return [self.filled(x, c) for x in t.args]
        if t.op in ("TypeArray", "TypeMatrix"):
            return [self.filled(t.args[0], c)]  # one for all elements
        return c

    def part_type(self, type_, index):
        t = self.t(type_)
        return t.args[index] if t.op == "TypeStruct" else t.args[0]

    def steps(self, type_, path):
        """Positions in a class of the parts that a path of indices (keys or numbers) leads to; None: any part of a vector."""
        out = []
        for index in path:
            t = self.t(type_)
            known = index if isinstance(index, int) else self.m.constant(index[0])
            if t.op in ("TypeArray", "TypeMatrix", "TypeRuntimeArray"):
                out.append(0)
            else:
                out.append(known)
            type_ = self.part_type(type_, known if t.op == "TypeStruct" else 0)
        return out, type_

    def at(self, c, steps):
        for n, s in enumerate(steps):
            if s is None:  # of a vector, which one is not known
                return self.at(c[0], steps[n + 1:]) if len(set(map(str, c))) == 1 else VARYING
            c = c[s]
        return c

    # pointers
    def pointer(self, key):
        """(storage, root key, path of index keys, type pointed to by the root) of a pointer that is a variable or a chain of accesses."""
        inst = self.m.ids[key[0]]
        if key in self.chains:
            base, indices = self.chains[key]
            storage, root, path, type_ = self.pointer(base)
            return storage, root, path + indices, type_
        if inst.op == "Variable":
            pointer = self.t(inst.type)
            return pointer.args[0], key, [], pointer.args[1]
        pointer = self.t(self.types.get(key, inst.type))
        return 5349, key, [], pointer.args[1]  # a loaded address

    # analysis
    def analyse(self):
        self.chains, self.order = {}, 0
        self.insts, self.accesses, self.exit_sites = [], {}, {}
        self.targets = {}
        self.walk([self.tree], [])
        for key, type_ in self.types.items():
            self.classes[key] = self.filled(type_, UNIFORM)
        self.masked = set()  # what lanes leave one by one: ("break", loop), ("continue", loop), ("return", call)
        while self.update():
            pass

    def walk(self, nodes, path):
        for n in nodes:
            if n.kind == "inst":
                self.order += 1
                self.note(n, path)
            elif n.kind == "phi":
                self.order += 1
                self.types.setdefault(n.id, n.type)
                n.path = tuple(path)
                self.accesses.setdefault(n.id, []).append(("store", self.order, n.path, n))
            elif n.kind == "if":
                for name in ("then", "other"):
                    self.walk(getattr(n, name), path + [(id(n), name)])
                self.targets[id(n)] = n
            elif n.kind == "rest":
                self.targets[id(n)] = n
                self.walk(n.body, path + [(id(n), "rest")])
            elif n.kind == "loop":
                self.targets[id(n)] = n
                self.walk(n.body, path + [(id(n), "loop")])
                self.walk(n.tail, path + [(id(n), "loop")])
                n.exits = exits_in([n]) | {("break", id(n)), ("continue", id(n))}
            elif n.kind == "call":
                self.targets[id(n)] = n
                self.walk(n.body, path + [(id(n), "call")])
            elif n.kind in ("break", "continue"):
                self.exit_sites.setdefault((n.kind, id(n.loop)), []).append(tuple(path))
            elif n.kind == "return":
                self.order += 1
                n.path = tuple(path)
                self.exit_sites.setdefault(("return", n.call), []).append(tuple(path))
                if n.value is not None:
                    self.accesses.setdefault(n.result, []).append(("store", self.order, n.path, n))

    def note(self, n, path):
        inst, ctx = n.inst, n.ctx
        n.path, n.key = tuple(path), None
        if inst.id is not None:
            n.key = ctx.name(inst.id)
            self.types[n.key] = inst.type
        if inst.op == "Variable":
            self.types[n.key] = self.t(inst.type).args[1]
            self.accesses.setdefault(n.key, [])
            return
        if inst.op in ("AccessChain", "InBoundsAccessChain"):
            self.chains[n.key] = (ctx.name(inst.args[0]), [ctx.name(a) for a in inst.args[1:]])
            return
        values = {"CompositeExtract": (0, 1), "CompositeInsert": (0, 2), "VectorShuffle": (0, 2), "ExtInst": (2, 99), "Load": (0, 1), "Store": (0, 2),
                  "ControlBarrier": (0, 0), "MemoryBarrier": (0, 0)}.get(inst.op, (0, 99))
        n.args = [ctx.name(a) if values[0] <= i < values[1] else None for i, a in enumerate(inst.args)]
        if inst.op in ("Load", "Store"):
            storage, root, _, _ = self.pointer(n.args[0])
            if storage == 7:
                self.accesses.setdefault(root, []).append((inst.op.lower(), self.order, n.path, n))
        self.insts.append(n)

    def is_divergent(self, step):
        node, name = self.targets[step[0]], step[1]
        if name in ("then", "other"):
            return not is_uniform(self.class_of(node.cond))
        if name == "rest":
            return any(e in self.masked for e in node.exits)
        if name == "loop":
            return any(e in self.masked for e in node.exits)
        return ("return", node.number) in self.masked

    def update_masked(self):
        changed = False
        for exit_, sites in self.exit_sites.items():
            if exit_ in self.masked:
                continue
            for path in sites:
                inside = False
                for step in path:
                    if inside and self.is_divergent(step):
                        self.masked.add(exit_)
                        changed = True
                        break
                    node = self.targets[step[0]]
                    if exit_[0] == "return":
                        inside = inside or (step[1] == "call" and node.number == exit_[1])
                    else:
                        inside = inside or id(node) == exit_[1]
                if exit_ in self.masked:
                    break
        # Where some lanes leave a loop under a mask, all leave it so.
        for node in self.targets.values():
            if node.kind == "loop":
                own = {("break", id(node)), ("continue", id(node))}
                if any(e in self.masked for e in node.exits) and not own <= self.masked:
                    self.masked |= own
                    changed = True
        return changed

    def class_of(self, key):
        if key in self.classes:
            return self.classes[key]
        return self.filled(self.m.ids[key[0]].type, UNIFORM)  # a constant

    def set_class(self, key, c):
        old = self.classes[key]
        if old == c:
            return False
        self.classes[key] = c
        return True

    def update(self):
        while self.update_masked():
            pass
        changed = False
        for n in self.insts:
            if n.key is not None:
                new = self.class_after(n)
                if new is not None:
                    changed |= self.set_class(n.key, new)
        for key, accesses in self.accesses.items():
            changed |= self.set_class(key, self.class_of_variable(key, accesses))
        return changed

    def class_of_variable(self, key, accesses):
        c = self.filled(self.types[key], None)
        for kind, order, path, n in accesses:
            if kind != "store":
                continue
            if n.kind in ("phi", "return"):
                steps, value = [], self.class_of(n.value)
            else:
                _, _, indices, type_ = self.pointer(n.args[0])
                steps, part = self.steps(type_, indices)
                value = self.class_of(n.args[1])
                if any(not is_uniform(self.class_of(i)) for i in indices):
                    value = self.filled(part, VARYING)
            if not self.seen_by_all(key, order, path, accesses):
                value = self.filled(self.type_at(key, steps), VARYING)
            c = self.put_store(c, steps, value)
        return self.settle(c)

    def type_at(self, key, steps):
        type_ = self.types[key]
        for s in steps:
            type_ = self.part_type(type_, s if self.t(type_).op == "TypeStruct" else 0)
        return type_

    def put_store(self, c, steps, value):
        if not steps:
            return self.join_store(c, value)
        out = list(c)
        for i in range(len(out)) if steps[0] is None else [steps[0]]:
            out[i] = self.put_store(out[i], steps[1:], value)
        return out

    def join_store(self, a, b):
        if a is None:
            return b
        if isinstance(a, int):
            return a if a == b else VARYING
        return [self.join_store(x, y) for x, y in zip(a, b)]

    def settle(self, c):
        return UNIFORM if c is None else c if isinstance(c, int) else [self.settle(x) for x in c]

    def seen_by_all(self, key, order, path, accesses):
        """Whether all lanes that read the variable later have taken part in this store."""
        divergent = [i for i, step in enumerate(path) if self.is_divergent(step)]
        if not divergent:
            return True
        inner = divergent[-1]
        # A call's result and what depends on where control came from is read where all lanes of the call, or of the branches, go on.
        if accesses[0][3].kind in ("phi", "return"):
            home = path
            for a in accesses:
                while a[2][:len(home)] != home:
                    home = home[:-1]
            if accesses[0][3].kind == "return":
                home = path[:next(i for i, step in enumerate(path) if step[1] == "call" and self.targets[step[0]].number == accesses[0][3].call)]
            return inner < len(home)
        scope = path[:inner + 1]
        inside = [a for a in accesses if a[2][:inner + 1] == scope]
        outside = [a for a in accesses if a[2][:inner + 1] != scope]
        first = min(inside, key=lambda a: a[1])
        fresh = self.sets_all(first) and all(a[2][:len(first[2])] == first[2] for a in inside)
        if (fresh or not self.runs_again(key, path, inner)) and not any(a[0] == "load" for a in outside):
            return True
        if scope[-1][1] == "loop":
            return bool(outside) and all(a[0] == "store" and a[2] == path[:inner] and a[1] < first[1] for a in outside)
        return False

    def sets_all(self, access):
        """Whether an access stores a variable as a whole."""
        kind, _, _, n = access
        return kind == "store" and (n.kind in ("phi", "return") or not self.pointer(n.args[0])[2])

    def runs_again(self, key, path, scope):
        """Whether the scope at a place of a path may run more than once while the variable lives: a call has variables of its own."""
        birth = next((i for i, step in enumerate(path) if step[1] == "call" and self.targets[step[0]].number == key[1]), -1)
        return any(step[1] == "loop" for step in path[birth + 1:scope])

    def carries(self, key, home):
        """Whether a variable whose accesses are all in the masked scope `home` may bring a value from one run of that scope to the next."""
        accesses = self.accesses[key]
        first = min(accesses, key=lambda a: a[1])
        if self.sets_all(first) and all(a[2][:len(first[2])] == first[2] for a in accesses):
            return False
        return self.runs_again(key, first[2], first[2].index(home[-1]))

    def class_after(self, n):
        inst = n.inst
        op = inst.op
        if op in ("Store", "ControlBarrier", "MemoryBarrier"):
            return None
        if op == "Load":
            storage, root, indices, type_ = self.pointer(n.args[0])
            if storage == 1:
                name = self.m.decorations[root[0]][11][0]
                return ALIGNED if name == 29 else self.filled(inst.type, UNIFORM)
            free = all(is_uniform(self.class_of(i)) for i in indices)
            if storage == 7:
                steps, _ = self.steps(type_, indices)
                return self.at(self.class_of(root), steps) if free else self.filled(inst.type, VARYING)
            if storage == 5349 and not is_uniform(self.class_of(root)):
                free = False
            return self.filled(inst.type, UNIFORM if free else VARYING)
        if op.startswith("Atomic"):
            return VARYING
        classes = [self.class_of(a) for a in n.args if a is not None]
        if op == "CompositeConstruct":
            t = self.t(inst.type)
            if t.op in ("TypeVector", "TypeStruct"):
                parts = []
                for c, a in zip(classes, n.args):
                    parts += c if t.op == "TypeVector" and isinstance(c, list) else [c]
                return parts
            out = classes[0]
            for c in classes[1:]:
                out = join(out, c)
            return [out]
        if op == "CompositeExtract":
            c, type_ = self.class_of(n.args[0]), self.type_of(n.args[0])
            for index in inst.args[1:]:
                c = c[0] if self.t(type_).op in ("TypeArray", "TypeMatrix") else c[index]
                type_ = self.part_type(type_, index if self.t(type_).op == "TypeStruct" else 0)
            return c
        if op in ("CopyObject", "CopyLogical"):
            return classes[0]
        if op == "VectorShuffle":
            both = self.class_of(n.args[0]) + self.class_of(n.args[1])
            return [both[i] for i in inst.args[2:]]
        if all(is_uniform(c) for c in classes):
            return self.filled(inst.type, UNIFORM)
        if all(x in (UNIFORM, HALVES) for c in classes for x in leaves(c)):
            return self.filled(inst.type, HALVES)
        if op == "Bitcast" and isinstance(classes[0], int):
            return classes[0]
        t = self.t(inst.type)
        if t.op == "TypeInt" and op != "ExtInst" and len(classes) == 2 and all(isinstance(c, int) for c in classes):
            return self.class_of_integer(op, n, classes)
        if t.op == "TypeVector":
            parts = t.args[1]
            if op in BINARY or op in COMPARE or op in ("Select", "ConvertUToF", "ConvertSToF", "ConvertFToU", "ConvertFToS", "FNegate"):
                return [UNIFORM if all(c[i] == UNIFORM if isinstance(c, list) else c == UNIFORM for c in classes) else VARYING for i in range(parts)]
        return self.filled(inst.type, VARYING)

    def class_of_integer(self, op, n, classes):
        a, b = classes
        k = self.m.constant(n.args[1][0])
        w = self.width
        if op == "IAdd" and min(a, b) == UNIFORM and max(a, b) in (ALIGNED, CONSECUTIVE):
            other = n.args[1] if b == UNIFORM else n.args[0]
            return ALIGNED if max(a, b) == ALIGNED and self.is_multiple(other[0]) else CONSECUTIVE
        if op == "ISub" and b == UNIFORM and a in (ALIGNED, CONSECUTIVE):
            return ALIGNED if a == ALIGNED and k is not None and k % w == 0 else CONSECUTIVE
        if op == "IMul" and k == 1:
            return a
        if op == "IAdd" and sorted((a, b)) == [UNIFORM, QUARTER]:
            return QUARTER
        if op == "IAdd" and EIGHTS in (a, b) and (a in (UNIFORM, HALVES) or b in (UNIFORM, HALVES)):
            return EIGHTS
        if a == ALIGNED and k == 8 and w == 16 and op in ("UDiv", "UMod"):
            return HALVES if op == "UDiv" else EIGHTS
        if a == ALIGNED and k is not None:
            if op == "UMod" and k % w == 0:
                return ALIGNED
            if op == "UDiv" and k % w == 0:
                return UNIFORM
            if op == "ShiftRightLogical" and (1 << k) % w == 0:
                return UNIFORM
            if op == "ShiftRightLogical" and k == 2:
                return QUARTER
            if op == "BitwiseAnd" and k == 3 and w > 4:
                return COMPONENT
            if op == "BitwiseAnd" and (k + 1) & k == 0 and (k + 1) % w == 0:
                return ALIGNED
        return VARYING

    def is_multiple(self, id_):
        """Whether a value is known to be a multiple of the width: a constant, or a product with one."""
        k, inst = self.m.constant(id_), self.m.ids[id_]
        return k % self.width == 0 if k is not None else inst.op == "IMul" and any(self.is_multiple(x) for x in inst.args)

    def type_of(self, key):
        return self.types[key] if key in self.types else self.m.ids[key[0]].type

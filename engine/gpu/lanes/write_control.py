"""The C++ of branches, loops and calls, under masks where lanes part."""
from parts import Leaf, as_lanes

LARGEST_UNROLLED = 32


class ControlWriter:
    """Part of Writer (write_cpp.py)."""

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

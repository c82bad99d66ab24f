"""What the blocks of a SPIR-V function say, as a tree: branches, loops, and calls with the callee's tree in their place."""
from spirv import fail, unknown


class Node:
    """kind: inst, phi (id takes a value), if, rest, loop, call, break, continue, return."""

    def __init__(self, kind, **rest):
        self.kind = kind
        self.__dict__.update(rest)


class Structurer:
    """The tree of one call of a function; ids that are its own get the call's number."""

    counter = 0

    def __init__(self, module, function, call_args, program):
        self.m, self.f, self.program = module, function, program
        Structurer.counter += 1
        self.number = Structurer.counter
        self.own = {}
        for param, arg in zip(function["params"], call_args):
            self.own[param.id] = arg
        self.result = None
        if self.m.ids[function["inst"].type].op != "TypeVoid":
            self.result = program.value(function["inst"].type, ("result", self.number))

    def name(self, id_):
        """The program's key of an id as this call sees it."""
        if id_ in self.own:
            return self.own[id_]
        inst = self.m.ids.get(id_)
        if inst is not None and id_ in self.f["ids"]:
            key = (id_, self.number)
            self.own[id_] = key
            return key
        return (id_, 0)

    def tree(self):
        loops = []
        nodes = self.region(self.f["first"], None, loops)
        return Node("call", body=nodes, number=self.number, result=self.result)

    def phis(self, target, source):
        out = []
        for inst in self.f["blocks"][target]:
            if inst.op != "Phi":
                break
            for value, pred in zip(inst.args[::2], inst.args[1::2]):
                if pred == source:
                    out.append(Node("phi", id=self.name(inst.id), type=inst.type, value=self.name(value)))
        return out

    def exit_to(self, target, stop, loops):
        """Node for a jump out of the region; None where it is not one; "end" at the region's own end."""
        if target == stop:
            return "end"
        if loops:
            loop = loops[-1]
            if target == loop.merge:
                return Node("break", loop=loop)
            if target == loop.cont:
                return Node("continue", loop=loop)
        return None

    def region(self, label, stop, loops, entered=False):
        nodes = []
        while True:
            block = self.f["blocks"][label]
            merge = next((i for i in block if i.op in ("LoopMerge", "SelectionMerge")), None)
            if merge is not None and merge.op == "LoopMerge" and not entered:
                loop = Node("loop", merge=merge.args[0], cont=merge.args[1], unroll=merge.args[2] & 1, number=self.number)
                if any(i.op == "Phi" for i in block):
                    fail(f"{self.m.path}: a loop's value over its iterations is not in a variable")
                loops.append(loop)
                loop.body = self.region(label, loop.cont, loops, entered=True)
                loop.tail = self.region(loop.cont, label, loops) if loop.cont != label else []
                loops.pop()
                nodes.append(loop)
                label = loop.merge
                continue
            entered = False
            for inst in block:
                if inst.op in ("Phi", "LoopMerge", "SelectionMerge", "Branch", "BranchConditional", "Return", "ReturnValue", "Unreachable"):
                    continue
                if inst.op == "FunctionCall":
                    nodes.append(self.program.call(self, inst))
                else:
                    nodes.append(Node("inst", inst=inst, ctx=self))
            last = block[-1]
            if last.op == "Branch":
                target = last.args[0]
                nodes += self.phis(target, label)
                out = self.exit_to(target, stop, loops)
                if out == "end":
                    return nodes
                if out is not None:
                    return nodes + [out]
                label = target
                continue
            if last.op == "Unreachable":
                return nodes
            if last.op == "Return":
                return nodes + [Node("return", value=None, call=self.number)]
            if last.op == "ReturnValue":
                return nodes + [Node("return", value=self.name(last.args[0]), result=self.result, call=self.number)]
            if last.op != "BranchConditional":
                unknown(self.m.path, last.op)
            condition, yes, no = last.args[:3]
            known = self.m.constant(condition)
            end = merge.args[0] if merge is not None and merge.op == "SelectionMerge" else None
            if end is not None:
                before = []
                for target in {yes, no}:
                    if target == end:
                        before += self.phis(end, label)
                branch = Node("if", cond=self.name(condition), then=[], other=[])
                for target, attribute in ((yes, "then"), (no, "other")):
                    if target == end or (known is not None and known != (attribute == "then")):
                        continue
                    out = self.exit_to(target, end, loops)
                    setattr(branch, attribute, [out] if isinstance(out, Node) else self.region(target, end, loops))
                nodes += before
                nodes.append(branch)
                label = end
                continue
            # No merge: one way leaves a loop.
            yes_out, no_out = self.exit_to(yes, stop, loops), self.exit_to(no, stop, loops)
            if isinstance(no_out, Node):
                nodes.append(Node("if", cond=self.name(condition), then=[], other=[no_out]))
                if yes_out == "end":
                    return nodes
                if isinstance(yes_out, Node):
                    return nodes + [yes_out]
                label = yes
            elif isinstance(yes_out, Node):
                nodes.append(Node("if", cond=self.name(condition), then=[yes_out], other=[]))
                if no_out == "end":
                    return nodes
                label = no
            else:
                fail(f"{self.m.path}: a branch without a merge that leaves no loop")


def exits_in(nodes):
    """What leaves a list of nodes: loops that are broken or continued, calls that are returned from."""
    out = set()
    for n in nodes:
        if n.kind == "break":
            out.add(("break", id(n.loop)))
        elif n.kind == "continue":
            out.add(("continue", id(n.loop)))
        elif n.kind == "return":
            out.add(("return", n.call))
        elif n.kind == "if":
            out |= exits_in(n.then) | exits_in(n.other)
        elif n.kind == "rest":
            out |= exits_in(n.body)
        elif n.kind == "loop":
            inner = exits_in(n.body) | exits_in(n.tail)
            out |= {e for e in inner if e not in (("break", id(n)), ("continue", id(n)))}
        elif n.kind == "call":
            out |= {e for e in exits_in(n.body) if e != ("return", n.number)}
    return out


def nest_rests(nodes):
    """What follows a node that some lanes may leave by is put in a node of its own."""
    out = []
    for at, n in enumerate(nodes):
        for attribute in ("then", "other", "body", "tail"):
            if hasattr(n, attribute):
                setattr(n, attribute, nest_rests(getattr(n, attribute)))
        out.append(n)
        if n.kind in ("if", "loop") and at + 1 < len(nodes):
            exits = exits_in([n])
            if exits:
                out.append(Node("rest", body=nest_rests(nodes[at + 1:]), exits=exits))
                return out
    return out

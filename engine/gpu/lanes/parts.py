"""Values as their scalars: a tree of lists with a leaf for each, which is a C++ variable of its own. What compilers do poorly with structs of vectors
(they keep them in memory and copy them) so never comes up."""
from collections import namedtuple

from spirv import fail
from uniformity import VARYING, is_uniform

# text: a C++ expression without side effects; varying: whether it is a vector over the lanes.
Leaf = namedtuple("Leaf", "text varying")


def first(leaf):
    """A leaf's value as a scalar, all lanes having the same."""
    return f"first({leaf.text})" if leaf.varying else leaf.text


def vary(leaf):
    return leaf.text if leaf.varying else f"vary({leaf.text})"


def as_lanes(leaf, varying):
    return vary(leaf) if varying else first(leaf)


def leaves_of(tree):
    return [tree] if isinstance(tree, Leaf) else [x for part in tree for x in leaves_of(part)]


def each(f, *trees):
    """f of the leaves that lie at the same places."""
    if not isinstance(trees[0], list):
        return f(*trees)
    return [each(f, *parts) for parts in zip(*trees)]


class Types:
    """Types of a module as C++ and as trees."""

    def __init__(self, module):
        self.m = module

    def of(self, type_):
        return self.m.ids[type_]

    def scalar(self, type_, varying):
        """C++ name of a scalar's type."""
        t = self.of(type_)
        if t.op == "TypeBool":
            return "vm" if varying else "bool"
        if t.op == "TypeInt":
            return ("vi" if varying else "std::int32_t") if t.args[1] else ("vu" if varying else "std::uint32_t")
        if t.op == "TypeFloat":
            return "vf" if varying else "float"
        if t.op == "TypePointer":
            return "ptr"
        return fail(f"{self.m.path}: a value of {t.op}")

    def is_scalar(self, type_):
        return self.of(type_).op in ("TypeBool", "TypeInt", "TypeFloat", "TypePointer")

    def parts(self, type_):
        """Types of a composite's parts."""
        t = self.of(type_)
        if t.op == "TypeStruct":
            return list(t.args)
        count = self.m.constant(t.args[1]) if t.op == "TypeArray" else t.args[1]
        return [t.args[0]] * count

    def part_classes(self, type_, c):
        """Classes of a composite's parts: an array's and a matrix's have one for all."""
        if self.of(type_).op in ("TypeArray", "TypeMatrix"):
            return c * len(self.parts(type_))
        return c

    def words(self, type_):
        """Size in words where nothing says how a type lies in memory."""
        return 1 + (self.of(type_).op == "TypePointer") if self.is_scalar(type_) else sum(map(self.words, self.parts(type_)))

    def variables(self, type_, c, name, indexed, suffix=""):
        """(tree, C++ declarations without values) of a variable. indexed: kinds of composites whose parts are picked while the kernel runs: those are C++ arrays."""
        if self.is_scalar(type_):
            varying = not is_uniform(c)
            return Leaf(name + suffix, varying), {name: (self.scalar(type_, varying), "")}
        tree, declared = [], {}
        kind = self.of(type_).op
        parts, classes = self.parts(type_), self.part_classes(type_, c)
        if kind in indexed and len({is_uniform(x) for x in classes}) > 1:  # the components of a vector, which one C++ array has
            classes = [VARYING] * len(parts)
        for i, (part, part_class) in enumerate(zip(parts, classes)):
            at = (name, f"{suffix}[{i}]") if kind in indexed else (f"{name}_{i}", suffix)
            part_tree, part_declared = self.variables(part, part_class, at[0], indexed, at[1])
            tree.append(part_tree)
            for key, (cpp, inner) in part_declared.items():
                declared[key] = (cpp, f"[{len(parts)}]" + inner if kind in indexed else inner)
        return tree, declared

    def literal(self, id_):
        """Tree of a constant."""
        inst = self.of(id_)
        if inst.op in ("ConstantNull", "Undef"):
            return self.zeros(inst.type)
        if inst.op in ("ConstantComposite", "SpecConstantComposite"):
            return [self.literal(a) for a in inst.args]
        value = self.m.constant(id_)
        if value is None:
            fail(f"{self.m.path}: {inst.op} is not a value")
        return self.number(inst.type, value)

    def number(self, type_, value):
        if isinstance(value, bool):
            return Leaf("true" if value else "false", False)
        if isinstance(value, float):
            return Leaf(f"{value.hex()}f", False) if abs(value) < float("inf") else fail(f"{self.m.path}: a constant that is no number")
        return Leaf(f"std::int32_t({value})" if self.of(type_).args[1] else f"{value}u", False)

    def zeros(self, type_):
        if self.is_scalar(type_):
            return Leaf(f"{self.scalar(type_, False)}{{}}", False)
        return [self.zeros(part) for part in self.parts(type_)]

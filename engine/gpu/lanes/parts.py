"""Values as trees of their scalars. Each scalar is a C++ variable of its own, because compilers keep structs of vectors
in memory and copy them."""
from __future__ import annotations

from typing import Any, Callable, NamedTuple, NoReturn, Union

from patterns import VARYING, Patterns, components, is_uniform
from spirv import Constant, Instruction, Module, fail
from spirv_names import SCALAR_TYPES, Op


class Leaf(NamedTuple):
    """A scalar: a C++ expression without side effects, and whether it is a vector over the lanes."""

    text: str
    varying: bool


Tree = Union[Leaf, list["Tree"]]
# Trees of the same shape with C++ expressions, or with whether a scalar is a vector over the lanes.
Texts = Union[str, list["Texts"]]
Flags = Union[bool, list["Flags"]]


class Declaration(NamedTuple):
    """A C++ declaration of a variable without a value: its type and array dimensions ("[4][3]")."""

    type: str
    dimensions: str


def first(leaf: Leaf) -> str:
    """The value as a scalar, if it is the same for all lanes."""
    return f"first({leaf.text})" if leaf.varying else leaf.text


def vary(leaf: Leaf) -> str:
    """The value as a vector over the lanes."""
    return leaf.text if leaf.varying else f"vary({leaf.text})"


def as_lanes(leaf: Leaf, varying: bool) -> str:
    return vary(leaf) if varying else first(leaf)


def each(f: Callable[..., Any], *trees: Any) -> Any:
    """Applies f to the leaves at the same positions of several trees. Returns a tree of the results."""
    if not isinstance(trees[0], list):
        return f(*trees)
    return [each(f, *parts) for parts in zip(*trees)]


class Types:
    """Types of a module in C++, and their trees."""

    def __init__(self, module: Module) -> None:
        self.module = module

    def of(self, id_: int) -> Instruction:
        return self.module.ids[id_]

    def _fail(self, text: str) -> NoReturn:
        fail(f"{self.module.path}: {text}")

    def scalar(self, type_: int, varying: bool) -> str:
        """C++ name of a scalar type."""
        t = self.of(type_)
        if t.op == Op.TypeBool:
            return "vm" if varying else "bool"
        if t.op == Op.TypeInt:
            is_signed = t.args[1]
            if is_signed:
                return "vi" if varying else "std::int32_t"
            return "vu" if varying else "std::uint32_t"
        if t.op == Op.TypeFloat:
            return "vf" if varying else "float"
        if t.op == Op.TypePointer:
            return "ptr"
        self._fail(f"a value of {t.op.name} is not supported")

    def is_scalar(self, type_: int) -> bool:
        return self.of(type_).op in SCALAR_TYPES

    def parts(self, type_: int) -> list[int]:
        """Types of the parts of a composite."""
        t = self.of(type_)
        if t.op == Op.TypeStruct:
            return list(t.args)
        count = self.module.constant(t.args[1]) if t.op == Op.TypeArray else t.args[1]
        assert isinstance(count, int)
        return [t.args[0]] * count

    def part_patterns(self, type_: int, p: Patterns) -> list[Patterns]:
        """Patterns of the parts of a composite, one for each element of an array or matrix."""
        if self.of(type_).op in (Op.TypeArray, Op.TypeMatrix):
            return components(p) * len(self.parts(type_))
        return components(p)

    def words(self, type_: int) -> int:
        """Size in words of a type without an explicit layout."""
        if self.is_scalar(type_):
            return 2 if self.of(type_).op == Op.TypePointer else 1
        return sum(map(self.words, self.parts(type_)))

    def variables(self, type_: int, p: Patterns, name: str, indexed: set[Op],
                  suffix: str = "") -> tuple[Tree, dict[str, Declaration]]:
        """The tree of a variable, and its C++ declarations by name. indexed: kinds of composites whose parts are
        selected at run time; these become C++ arrays."""
        if self.is_scalar(type_):
            varying = not is_uniform(p)
            return Leaf(name + suffix, varying), {name: Declaration(self.scalar(type_, varying), "")}
        tree: list[Tree] = []
        declarations: dict[str, Declaration] = {}
        is_array = self.of(type_).op in indexed
        parts, patterns = self.parts(type_), self.part_patterns(type_, p)
        if is_array and len({is_uniform(x) for x in patterns}) > 1:  # all components of a vector share one C++ type
            patterns = [VARYING] * len(parts)
        for i, (part, pattern) in enumerate(zip(parts, patterns)):
            part_name, part_suffix = (name, f"{suffix}[{i}]") if is_array else (f"{name}_{i}", suffix)
            part_tree, part_declarations = self.variables(part, pattern, part_name, indexed, part_suffix)
            tree.append(part_tree)
            for key, (cpp, inner) in part_declarations.items():
                declarations[key] = Declaration(cpp, f"[{len(parts)}]{inner}" if is_array else inner)
        return tree, declarations

    def literal(self, id_: int) -> Tree:
        """Tree of a constant."""
        inst = self.of(id_)
        if inst.op in (Op.ConstantNull, Op.Undef):
            return self.zeros(inst.type)
        if inst.op in (Op.ConstantComposite, Op.SpecConstantComposite):
            return [self.literal(a) for a in inst.args]
        value = self.module.constant(id_)
        if value is None:
            self._fail(f"{inst.op.name} is not a constant")
        return self.number(inst.type, value)

    def number(self, type_: int, value: Constant) -> Leaf:
        if isinstance(value, bool):
            return Leaf("true" if value else "false", False)
        if isinstance(value, float):
            if not abs(value) < float("inf"):
                self._fail("a constant is infinite or NaN")
            return Leaf(f"{value.hex()}f", False)
        is_signed = self.of(type_).args[1]
        return Leaf(f"std::int32_t({value})" if is_signed else f"{value}u", False)

    def zeros(self, type_: int) -> Tree:
        if self.is_scalar(type_):
            return Leaf(f"{self.scalar(type_, False)}{{}}", False)
        return [self.zeros(part) for part in self.parts(type_)]

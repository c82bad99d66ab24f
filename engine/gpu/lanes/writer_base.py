"""State that all parts of the writer share: the lines written so far, and the trees of values."""
from __future__ import annotations

from calls import Key
from expressions import Expressions
from nodes import CallNode, Exit, InstructionNode, LoopNode, Node
from parts import Flags, Leaf, Texts, Tree, Types
from patterns import Patterns, is_uniform
from program import Program
from spirv_names import Op
from uniformity import Uniformity


class WriterBase:
    """State of the writer of one kernel. A mask is the name of a C++ variable, or None for all lanes."""

    def __init__(self, program: Program, name: str) -> None:
        self.program, self.module, self.name = program, program.module, name
        self.uniformity = Uniformity(program)
        self.types = Types(self.module)
        self.expressions = Expressions(self.types)
        self.lines: list[str] = []
        self.depth = 1
        self.trees: dict[Key, Tree] = {}
        self.known: dict[Key, int] = {}  # integers that are known during translation
        self.counting: dict[Key, int] = {}  # values of the counters of unrolled loops
        self.makers: dict[Key, InstructionNode] = {n.key: n for n in program.instructions if n.key is not None}
        self.used: set[Key | None] = set()  # values that something reads
        self.indexed: dict[Key, set[Op]] = {}  # kinds of composites in a variable that must be C++ arrays
        self.labels: set[str] = set()  # labels that a goto jumps to
        self.exit_masks: dict[Exit, str] = {}  # masks of the lanes that have left
        self.return_labels: dict[int, str] = {}  # by number of the call
        self.last_returns: set[Node] = set()  # returns at the end of a call, which need no goto
        self._temporaries = 0

    # Methods of the parts of the writer that other parts call.

    def instruction(self, n: InstructionNode, mask: str | None) -> None:
        raise NotImplementedError

    def assign(self, target: Tree, value: Tree, p: Patterns, type_: int, mask: str | None) -> None:
        raise NotImplementedError

    def unrolled(self, n: LoopNode) -> range | None:
        raise NotImplementedError

    def counter(self, n: LoopNode) -> Key:
        raise NotImplementedError

    # Output.

    def out(self, text: str) -> None:
        self.lines.append("  " * self.depth + text)

    def fresh(self, stem: str) -> str:
        """A new C++ name."""
        self._temporaries += 1
        return f"{stem}{self._temporaries}"

    # Values.

    def pattern(self, key: Key) -> Patterns:
        return self.uniformity.of(key)

    def is_masked(self, exit_: Exit) -> bool:
        return exit_ in self.uniformity.masked

    def tree(self, key: Key) -> Tree:
        if key not in self.program.types:
            return self.types.literal(key.id)
        return self.trees[key]

    def leaf(self, key: Key) -> Leaf:
        """The tree of a scalar."""
        tree = self.tree(key)
        assert isinstance(tree, Leaf)
        return tree

    def number(self, key: Key) -> int | None:
        """An integer that is known during translation, else None."""
        if key not in self.program.types:
            value = self.module.constant(key.id)
            return value if isinstance(value, int) else None
        return self.known.get(key)

    def differs(self, key: Key) -> bool:
        """Whether any part of a value may differ between lanes."""
        return not is_uniform(self.pattern(key))

    @staticmethod
    def stem(key: Key) -> str:
        return f"result_{key.call}" if key.is_result else f"x{key.id}_{key.call}"

    def wanted(self, type_: int, p: Patterns) -> Flags:
        """For each scalar of a value, whether it is a vector over the lanes."""
        if self.types.is_scalar(type_):
            return not is_uniform(p)
        return [self.wanted(t, x) for t, x in zip(self.types.parts(type_), self.types.part_patterns(type_, p))]

    def declare(self, key: Key, type_: int) -> None:
        """Declares a local variable, the result of a call, or a phi."""
        indexed = self.indexed.get(key, set())
        self.trees[key], declarations = self.types.variables(type_, self.pattern(key), self.stem(key), indexed)
        for name, (cpp, dimensions) in declarations.items():
            # Masked stores keep the old value in other lanes, so there must be one. Arrays stay uninitialised, because
            # clearing them takes measurable time.
            self.out(f"[[maybe_unused]] {cpp} {name}{dimensions}{'' if dimensions else '{}'};")

    def define(self, key: Key, type_: int, texts: Texts, wanted: Flags) -> None:
        """Writes a constant for each scalar of a value."""
        count = 0

        def name(part_type: int, text: Texts, w: Flags) -> Tree:
            nonlocal count
            if isinstance(text, list):
                assert isinstance(w, list)
                return [name(t, x, y) for t, x, y in zip(self.types.parts(part_type), text, w)]
            assert isinstance(w, bool)
            count += 1
            variable = f"{self.stem(key)}_{count}"
            self.out(f"[[maybe_unused]] const {self.types.scalar(part_type, w)} {variable} = {text};")
            return Leaf(variable, w)
        self.trees[key] = name(type_, texts, wanted)


def children_in_call(n: Node) -> list[list[Node]]:
    """The lists of nodes in a node, unless it is a call."""
    return [] if isinstance(n, CallNode) else list(n.children())

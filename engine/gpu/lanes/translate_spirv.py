#!/usr/bin/env python3
"""Translates kernels from SPIR-V to C++ with SIMD: one thread of a CPU runs WIDTH invocations of a workgroup at once.

Values that are the same for all invocations stay scalars. All others are vectors with a lane for each invocation. A
branch that lanes take differently runs under a mask (Karrenberg and Hack, Whole-Function Vectorization, 2011; Pharr and
Mark, ispc, 2012). The C++ uses the functions of lanes.h and lane_memory.h. Barriers are calls of barrier(); a workgroup
of WIDTH invocations needs none.

usage: translate_spirv.py WIDTH FUNCTION OUTPUT TABLE KERNEL.spv:NAME:[CONSTANT,...] ...

OUTPUT receives the kernels, to be compiled for CPUs with vectors of WIDTH words. TABLE receives FUNCTION, in namespace
trisoup::gpu::host, which returns the kernels. It is a file of its own because it runs on any CPU. A plus after the
first constant: it is the length of an array.
"""
from __future__ import annotations

import sys
from typing import NamedTuple

from program import Program
from spirv import Module, fail
from spirv_names import Op, StorageClass
from write_cpp import Writer


class Layout(NamedTuple):
    """Size and alignment in bytes."""

    size: int
    alignment: int


class TableEntry(NamedTuple):
    """A kernel in TABLE: its namespace, and the row that describes it."""

    space: str
    row: str


def layout_of(module: Module, type_: int) -> Layout:
    """Layout in C++ of a struct of words, addresses and such structs."""
    t = module.ids[type_]
    if t.op != Op.TypeStruct:
        return Layout(8, 8) if t.op == Op.TypePointer else Layout(4, 4)
    members = [layout_of(module, member) for member in t.args]
    alignment = max(member.alignment for member in members)
    end = module.member_offsets[type_, len(members) - 1] + members[-1].size
    return Layout(-(-end // alignment) * alignment, alignment)


def size_of_arguments(module: Module) -> int:
    for variable in module.globals:
        storage, type_ = module.ids[variable.type].args[:2]
        if storage == StorageClass.PushConstant:
            return layout_of(module, type_).size
    return fail(f"{module.path}: no push constants")


def translate(kernel: str, width: int) -> tuple[str, TableEntry]:
    """The C++ of a kernel, given as PATH:NAME:CONSTANTS, and its entry in the table."""
    path, name, constants = kernel.split(":")
    values = [int(c.rstrip("+")) for c in constants.split(",") if c]
    module = Module(path, values)
    if module.local_size % width:
        fail(f"{path}: the workgroup size {module.local_size} is not a multiple of {width}")
    space = "_".join([name, *map(str, values)])
    written = Writer(Program(module, width), space).write()
    is_array, has_barriers = (str(flag).lower() for flag in ("+" in constants, written.has_barriers))
    row = (f'{{"{name}", {{{", ".join(map(str, values))}}}, {is_array}, {has_barriers}, {module.local_size}, '
           f"{size_of_arguments(module)}, lanes{width}::{space}::run, {width}}}")
    return written.text, TableEntry(space, row)


def table_text(function: str, width: int, entries: list[TableEntry]) -> str:
    declarations = "".join(f"namespace {e.space} {{ void run(const std::byte* arguments); }}\n" for e in entries)
    rows = "".join(f"    {e.row},\n" for e in entries)
    return ('#include "gpu/compiled_kernels.h"\n\n'
            "namespace trisoup::gpu::host {\n"
            f"namespace lanes{width} {{\n{declarations}}}\n\n"
            f"std::span<const CompiledKernel> {function}();\n"
            f"std::span<const CompiledKernel> {function}() {{\n"
            f"  static const std::vector<CompiledKernel> kernels{{\n{rows}  }};\n"
            "  return kernels;\n}\n}\n")


def main(arguments: list[str]) -> int:
    if arguments[:1] in (["-h"], ["--help"]):
        print(__doc__)
        return 0
    if len(arguments) < 5:
        print(__doc__, file=sys.stderr)
        return 1
    function, output, table = arguments[1:4]
    width = int(arguments[0])
    texts, entries = zip(*(translate(kernel, width) for kernel in arguments[4:]))
    with open(output, "w", encoding="utf-8") as f:
        f.write(f'#define WIDTH {width}\n#include "gpu/lanes/lane_memory.h"\n\n'
                f"namespace trisoup::gpu::host::lanes{width} {{\n{''.join(texts)}}}\n")
    with open(table, "w", encoding="utf-8") as f:
        f.write(table_text(function, width, list(entries)))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

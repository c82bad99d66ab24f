#!/usr/bin/env python3
"""Kernels as SIMD code for a CPU: SPIR-V in, C++ out, in which one thread of the CPU runs WIDTH invocations of a workgroup at once.

What is the same for all invocations stays a scalar; the rest is a vector with a lane for each of them. A branch that lanes take
differently runs under a mask (Karrenberg and Hack, Whole-Function Vectorization, 2011; Pharr and Mark, ispc, 2012). What the C++ is
written in is lanes.h and lane_memory.h. Barriers are calls of barrier(); a workgroup of WIDTH invocations needs none.

usage: translate_spirv.py WIDTH FUNCTION OUTPUT TABLE KERNEL.spv:NAME:[CONSTANT,...] ...
OUTPUT has the kernels, for a compiler that may use vectors of WIDTH. TABLE has FUNCTION, of namespace trisoup::gpu::host, which returns them: a file of its own,
since it runs on any CPU. A plus after the first constant: it is the length of an array.
"""
import sys

from spirv import Module, fail
from uniformity import Program
from write_cpp import Writer


def bytes_of(module, type_):
    """(size, alignment) in memory of a struct of words, addresses and such structs, as C++ has it."""
    t = module.ids[type_]
    if t.op != "TypeStruct":
        return (8, 8) if t.op == "TypePointer" else (4, 4)
    parts = [bytes_of(module, x) for x in t.args]
    alignment = max(a for _, a in parts)
    end = module.member_offsets[type_, len(parts) - 1] + parts[-1][0]
    return -(-end // alignment) * alignment, alignment


def main():
    if len(sys.argv) < 6 or sys.argv[1] in ("-h", "--help"):
        print(__doc__)
        sys.exit(0 if len(sys.argv) > 1 and sys.argv[1] in ("-h", "--help") else 1)
    width, function, output, table, kernels = int(sys.argv[1]), sys.argv[2], sys.argv[3], sys.argv[4], sys.argv[5:]
    body, rows, declared = "", "", ""
    for kernel in kernels:
        path, name, constants = kernel.split(":")
        values = [int(c.rstrip("+")) for c in constants.split(",") if c]
        module = Module(path, values)
        if module.local_size % width:
            fail(f"{path}: workgroups of {module.local_size} are no multiple of {width}")
        space = "_".join([name] + [str(v) for v in values])
        text, barriers = Writer(Program(module, width), space).write()
        body += text
        arguments = next(v for v in module.globals if module.ids[v.type].args[0] == 9)
        size, _ = bytes_of(module, module.ids[arguments.type].args[1])
        flags = [str(flag).lower() for flag in ("+" in constants, barriers)]
        declared += f"namespace {space} {{ void run(const std::byte* arguments); }}\n"
        rows += f'    {{"{name}", {{{", ".join(map(str, values))}}}, {", ".join(flags)}, {module.local_size}, {size}, lanes{width}::{space}::run, {width}}},\n'
    with open(output, "w") as f:
        f.write(f'#define WIDTH {width}\n#include "gpu/lanes/lane_memory.h"\n\nnamespace trisoup::gpu::host::lanes{width} {{\n{body}}}\n')
    with open(table, "w") as f:
        f.write(f'#include "gpu/compiled_kernels.h"\n\nnamespace trisoup::gpu::host {{\nnamespace lanes{width} {{\n{declared}}}\n\n'
                f"std::span<const CompiledKernel> {function}();\nstd::span<const CompiledKernel> {function}() {{\n"
                f"  static const std::vector<CompiledKernel> kernels{{\n{rows}  }};\n  return kernels;\n}}\n}}\n")


if __name__ == "__main__":
    main()

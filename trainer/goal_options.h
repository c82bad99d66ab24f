// Options that soup-train and soup-simplify have in common.
#pragma once

#include <CLI/CLI.hpp>

#include "command_line.h"

namespace trisoup {

/// --target-psnr and the like, into `o`, as a group of their own.
void add_goal_options(CLI::App& app, CommandLine& o);

/// Options that count something take whole numbers from 0 on, and say so. (strtoull turns -1 and what is too large into
/// the largest number there is.)
void check_whole_numbers(CLI::App& app);

}  // namespace trisoup

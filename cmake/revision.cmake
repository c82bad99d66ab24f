# Writes revision.h with the git revision of the sources. Runs at every build; the file is rewritten only if it changes.
execute_process(COMMAND git -C ${SOURCE} describe --always --dirty --abbrev=12
                OUTPUT_VARIABLE revision OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(NOT revision)
  set(revision unknown)
endif()
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT "#pragma once

namespace trisoup {
/// Git revision that the programs were built from.
inline constexpr const char* kRevision = \"${revision}\";
}  // namespace trisoup
")

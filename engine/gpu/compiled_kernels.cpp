#include "gpu/compiled_kernels.h"

#include "base/error.h"

namespace trisoup::gpu {

template <typename Run>
const Compiled<Run>& find_compiled(std::span<const Compiled<Run>> kernels, const Kernel& kernel,
                                   std::size_t argument_bytes) {
  for (const Compiled<Run>& k : kernels) {
    if (k.name != kernel.name || k.constants.size() < kernel.constants.size()) continue;
    bool fits = true;
    for (std::size_t i = 0; i < k.constants.size(); ++i) {
      const std::uint32_t asked = i < kernel.constants.size() ? kernel.constants[i] : 0;
      fits = fits && (i == 0 && k.first_is_length ? k.constants[i] >= asked : k.constants[i] == asked);
    }
    if (!fits) continue;
    if (argument_bytes > k.argument_bytes)
      throw Error("kernel {}: takes {} bytes of arguments, not {}; rebuild the program", kernel.name, k.argument_bytes,
                  argument_bytes);
    return k;
  }
  throw Error("kernel {}: not compiled with these constants; add them to engine/gpu/kernel_variants.cmake",
              kernel.name);
}

template const Compiled<host::Run>& find_compiled(std::span<const Compiled<host::Run>>, const Kernel&, std::size_t);
template const Compiled<cuda::Run>& find_compiled(std::span<const Compiled<cuda::Run>>, const Kernel&, std::size_t);

}  // namespace trisoup::gpu

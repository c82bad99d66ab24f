#include "bench_kernels.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "cli/output_text.h"
#include "csv_table.h"
#include "gpu/compiled_kernels.h"

namespace trisoup::bench {
namespace {

// Shared memory per multiprocessor: AMD, Intel and Turing; GeForce RTX 30 and 40; H100 and H200.
constexpr std::array<std::uint32_t, 3> kKilobytes{64, 100, 228};

struct KernelRow {
  std::string kernel, constants;
  gpu::KernelResources resources;
};

std::vector<KernelRow> kernel_rows(gpu::Device& gpu) {
  std::vector<KernelRow> rows;
  // The list for the CPU holds all variants, whatever the device.
  for (const gpu::host::CompiledKernel& k : gpu::host::compiled_kernels()) {
    const gpu::Kernel kernel{k.name.data(), k.constants};
    std::optional<gpu::KernelResources> resources = gpu.kernel_resources(kernel);
    if (!resources) continue;
    std::string constants;
    for (std::size_t i = 0; i < k.constants.size(); ++i)
      constants += fmt::format("{}{}{}", i > 0 ? " " : "", k.constants[i], i == 0 && k.first_is_length ? "+" : "");
    rows.push_back({kernel.name, std::move(constants), std::move(*resources)});
  }
  return rows;
}

std::string text(const std::optional<std::uint32_t>& value, const char* unknown) {
  return value ? fmt::format("{}", *value) : unknown;
}

/// Returns one line that says why columns are empty, or "" if none is.
std::string what_is_missing(const gpu::DeviceInfo& device, const std::vector<KernelRow>& rows) {
  const bool said = std::ranges::any_of(rows, [](const KernelRow& r) { return r.resources.registers.has_value(); });
  const bool statistics = std::ranges::any_of(rows, [](const KernelRow& r) { return !r.resources.statistics.empty(); });
  if (said) return "";
  if (device.backend == "cpu") return "-: only GPUs report this; shared memory is what the shader declares";
  if (statistics) return "-: the driver reports other statistics; --csv writes all of them";
  return "-: the driver lacks VK_KHR_pipeline_executable_properties; shared memory is what the shader declares";
}

void write_csv(const std::string& file, const gpu::DeviceInfo& device, const std::vector<KernelRow>& rows) {
  std::string csv = "kernel,constants,threads,registers,local_bytes,shared_bytes,groups";
  for (const std::uint32_t kilobytes : kKilobytes) csv += fmt::format(",groups_{}_kb", kilobytes);
  csv += ",backend,device,driver,statistics\n";  // columns that may be quoted come last
  for (const KernelRow& row : rows) {
    const gpu::KernelResources& r = row.resources;
    csv += fmt::format("{},{},{},{},{},{},{}", row.kernel, row.constants, r.threads, text(r.registers, ""),
                       text(r.local_bytes, ""), r.shared_bytes, text(r.groups, ""));
    for (const std::uint32_t kilobytes : kKilobytes)
      csv += fmt::format(",{}", groups_by_shared_memory(kilobytes, r.threads, r.shared_bytes));
    csv += fmt::format(",{},{},{},{}\n", device.backend, csv_field(device.name), csv_field(device.driver),
                       csv_field(r.statistics));
  }
  write_output(file, csv);
}

}  // namespace

std::uint32_t groups_by_shared_memory(std::uint32_t kilobytes, std::uint32_t threads, std::uint32_t shared_bytes) {
  constexpr std::uint32_t kMostGroups = 32, kMostThreads = 2048;
  const std::uint32_t groups = std::min(kMostGroups, kMostThreads / std::max(1u, threads));
  const std::uint32_t each = shared_bytes + (kilobytes > 64 ? 1024 : 0);
  return each == 0 ? groups : std::min(groups, kilobytes * 1024 / each);
}

void kernels(gpu::Device& gpu, const KernelsOptions& options) {
  const gpu::DeviceInfo& device = gpu.info();
  const std::vector<KernelRow> rows = kernel_rows(gpu);
  std::FILE* const out = text_stream(options.csv);
  std::fprintf(out, "device: %s, %s\n", device.name.c_str(), device.driver.c_str());
  std::fprintf(
      out,
      "registers, local: registers and bytes of local memory per thread; shared: bytes of shared memory per workgroup\n"
      "groups: workgroups that fit on a multiprocessor of this device\n"
      "64, 100, 228 KB: the same for that much shared memory, 2048 threads and 32 workgroups, ignoring registers\n");
  std::fprintf(out, "%-26s%8s%10s%7s%8s%8s", "kernel, constants", "threads", "registers", "local", "shared", "groups");
  for (const std::uint32_t kilobytes : kKilobytes) std::fprintf(out, "%8s", fmt::format("{} KB", kilobytes).c_str());
  std::fprintf(out, "\n");
  for (const KernelRow& row : rows) {
    const gpu::KernelResources& r = row.resources;
    std::fprintf(out, "%-26s%8u%10s%7s%8u%8s",
                 (row.kernel + (row.constants.empty() ? "" : " ") + row.constants).c_str(), r.threads,
                 text(r.registers, "-").c_str(), text(r.local_bytes, "-").c_str(), r.shared_bytes,
                 text(r.groups, "-").c_str());
    for (const std::uint32_t kilobytes : kKilobytes)
      std::fprintf(out, "%8u", groups_by_shared_memory(kilobytes, r.threads, r.shared_bytes));
    std::fprintf(out, "\n");
  }
  if (const std::string missing = what_is_missing(device, rows); !missing.empty())
    std::fprintf(out, "%s\n", missing.c_str());
  if (!options.csv.empty()) write_csv(options.csv, device, rows);
}

}  // namespace trisoup::bench

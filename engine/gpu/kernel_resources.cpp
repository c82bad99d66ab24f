#include "gpu/kernel_resources.h"

#include <algorithm>
#include <initializer_list>
#include <map>
#include <span>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "kernel_binaries.h"

namespace trisoup::gpu {
namespace {

// Values from the SPIR-V specification, sections 3 and 3.49.
enum Opcode : std::uint32_t {
  kExecutionMode = 16,
  kTypeBool = 20,
  kTypeInt,
  kTypeFloat,
  kTypeVector,
  kTypeMatrix,
  kTypeArray = 28,
  kTypeStruct = 30,
  kTypePointer = 32,
  kConstant = 43,
  kSpecConstant = 50,
  kSpecConstantOp = 52,
  kFunction = 54,
  kVariable = 59,
  kDecorate = 71,
  kIAdd = 128,
  kISub = 130,
  kIMul = 132,
  kUDiv = 134
};
constexpr std::uint32_t kLocalSize = 17, kSpecId = 1, kWorkgroup = 4;

/// The declarations of a SPIR-V module. Function bodies are ignored.
class Module {
 public:
  using Instruction = std::span<const std::uint32_t>;

  explicit Module(const Kernel& kernel) : kernel_(kernel), words_(kernel_binary(kernel.name)) {
    if (words_.empty()) throw Error("there is no kernel '{}'; check the name", kernel.name);
    constexpr std::size_t kHeader = 5;
    for (std::size_t at = kHeader; at < words_.size();) {
      const Instruction i = words_.subspan(at, words_[at] >> 16);
      const std::uint32_t opcode = i[0] & 0xffff;
      if (opcode == kFunction) break;
      if (opcode == kExecutionMode && i[2] == kLocalSize) threads_ = i[3] * i[4] * i[5];
      if (opcode == kDecorate && i[2] == kSpecId) spec_ids_[i[1]] = i[3];
      if (opcode >= kTypeBool && opcode <= kTypePointer) by_id_[i[1]] = i;
      if (opcode >= kConstant && opcode <= kSpecConstantOp) by_id_[i[2]] = i;
      if (opcode == kVariable && i[3] == kWorkgroup) shared_.push_back(i);
      at += i.size();
    }
  }
  KernelResources resources() const {
    KernelResources r;
    r.threads = threads_;
    for (const Instruction& variable : shared_) r.shared_bytes += bytes(at(variable[1])[3]);
    return r;
  }

 private:
  Instruction at(std::uint32_t id) const {
    if (const auto found = by_id_.find(id); found != by_id_.end()) return found->second;
    throw unknown(0);
  }
  Error unknown(std::uint32_t opcode) const {
    return Error(
        "kernel {}: SPIR-V instruction {} in the declaration of shared memory is not supported; add it to "
        "kernel_resources.cpp",
        kernel_.name, opcode);
  }

  std::uint32_t value(std::uint32_t id) const {
    const Instruction i = at(id);
    const std::uint32_t opcode = i[0] & 0xffff;
    if (opcode == kSpecConstant)
      if (const auto spec = spec_ids_.find(id); spec != spec_ids_.end() && spec->second < kernel_.constants.size())
        return kernel_.constants[spec->second];
    if (opcode == kConstant || opcode == kSpecConstant) return i[3];
    if (opcode != kSpecConstantOp) throw unknown(opcode);
    switch (i[3]) {
      case kIAdd:
        return value(i[4]) + value(i[5]);
      case kISub:
        return value(i[4]) - value(i[5]);
      case kIMul:
        return value(i[4]) * value(i[5]);
      case kUDiv:
        return value(i[4]) / std::max(1u, value(i[5]));
      default:
        throw unknown(i[3]);
    }
  }

  std::uint32_t bytes(std::uint32_t type) const {
    const Instruction i = at(type);
    switch (i[0] & 0xffff) {
      case kTypeBool:
        return 4;
      case kTypeInt:
      case kTypeFloat:
        return i[2] / 8;
      case kTypeVector:
      case kTypeMatrix:
        return bytes(i[2]) * i[3];
      case kTypeArray:
        return bytes(i[2]) * value(i[3]);
      case kTypeStruct: {
        std::uint32_t sum = 0;
        for (const std::uint32_t member : i.subspan(2)) sum += bytes(member);
        return sum;
      }
      case kTypePointer:
        return 8;  // an address in device memory
      default:
        throw unknown(i[0] & 0xffff);
    }
  }

  const Kernel& kernel_;
  std::span<const std::uint32_t> words_;
  std::map<std::uint32_t, Instruction> by_id_;  // types and constants
  std::map<std::uint32_t, std::uint32_t> spec_ids_;
  std::vector<Instruction> shared_;
  std::uint32_t threads_ = 0;
};

}  // namespace

KernelResources declared_resources(const Kernel& kernel) { return Module(kernel).resources(); }

void take_statistic(KernelResources& resources, const std::string& name, std::uint64_t value) {
  const auto is = [&](std::initializer_list<std::string_view> names) {
    return std::ranges::find(names, name) != names.end();
  };
  const auto raise = [&](std::optional<std::uint32_t>& field) {
    field = std::max(field.value_or(0), static_cast<std::uint32_t>(value));
  };
  // The names used by NVIDIA's driver, NVK, RADV, AMD's driver and Intel's ANV.
  if (is({"Register Count", "Number of GPRs", "VGPRs", "numUsedVgprs", "Max live registers"}))
    raise(resources.registers);
  if (is({"Local Memory Size", "SLM Size", "Scratch size", "scratchMemUsageInBytes", "Scratch Memory Size"}))
    raise(resources.local_bytes);
  if (is({"Shared Memory Size", "LDS size", "LDS Size", "ldsUsageSizeInBytes", "Workgroup Memory Size"}))
    resources.shared_bytes = static_cast<std::uint32_t>(value);
}

}  // namespace trisoup::gpu

#include "emulated_cuda/machine.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>

#include <sys/mman.h>
#include <unistd.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "gpu/host/workgroup.h"

namespace trisoup::emulated_cuda {
namespace {

// Created at first use, because static objects of other files fill them.
std::map<std::string, Kernel, std::less<>>& kernels() {
  static std::map<std::string, Kernel, std::less<>> all;
  return all;
}
std::map<std::pair<int, int>, std::string>& files() {
  static std::map<std::pair<int, int>, std::string> all;
  return all;
}
std::map<std::uint64_t, std::uint64_t>& constants() {  // start address to end address
  static std::map<std::uint64_t, std::uint64_t> all;
  return all;
}

std::string without_hash(std::string_view name) {
  const std::size_t start = name.find("_GLOBAL__N__");
  if (start == std::string_view::npos) return std::string(name);
  // The digits before the name are its length. The name ends with two words of a hash around the file's name.
  const std::size_t length_at = name.find_last_not_of("0123456789", start - 1) + 1;
  const std::size_t length = std::stoul(std::string(name.substr(length_at, start - length_at)));
  return std::string(name.substr(0, length_at)) + "_" + std::string(name.substr(start + length));
}

/// Returns the kernel's name from a mangled name: "shade_backward_one_1" from
/// _ZN7trisoup3gpu4cuda20shade_backward_one_16kernelENS1_17ShadeBackwardArgsE.
std::string readable(std::string_view name) {
  constexpr std::string_view kScope = "4cuda";
  const std::size_t scope = name.find(kScope);
  if (scope == std::string_view::npos) return std::string(name);
  std::string_view rest = name.substr(scope + kScope.size());
  const std::size_t digits = rest.find_first_not_of("0123456789");
  if (digits == 0 || digits == std::string_view::npos) return std::string(name);
  return std::string(rest.substr(digits, std::stoul(std::string(rest.substr(0, digits)))));
}

/// Reserves address space. Returns null on failure.
void* reserve(std::size_t bytes) {
  void* const taken = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  return taken == MAP_FAILED ? nullptr : taken;
}

}  // namespace

Machine machine;

Registration::Registration(std::initializer_list<Kernel> more) {
  for (const Kernel& kernel : more) kernels().emplace(without_hash(kernel.name), kernel);
}
SourceFile::SourceFile(int module, int number, const char* path) { files()[{module, number}] = path; }
Constant::Constant(const void* data, std::size_t bytes) {
  const auto start = reinterpret_cast<std::uint64_t>(data);
  constants()[start] = start + bytes;
}
const Kernel* find_kernel(std::string_view name) {
  const auto found = kernels().find(without_hash(name));
  return found == kernels().end() ? nullptr : &found->second;
}
std::vector<const Kernel*> all_kernels() {
  std::vector<const Kernel*> all;
  for (const auto& [name, kernel] : kernels()) all.push_back(&kernel);
  return all;
}

Machine::Machine() {
  counting_ = std::getenv("TRISOUP_COUNTS") != nullptr;
  backwards_ = std::getenv("TRISOUP_BACKWARDS") != nullptr;
}

bool Machine::reserve_arena() {
  if (base_ != 0) return true;
  void* const memory = reserve(kArena);
  shadow_ = static_cast<Word*>(reserve(kArena / 4 * sizeof(Word)));
  owners_ = static_cast<std::uint32_t*>(reserve(kArena / kBlock * sizeof(std::uint32_t)));
  if (!memory || !shadow_ || !owners_) {
    std::fprintf(stderr, "emulated CUDA: no %zu GB of address space for its memory and the records of it\n",
                 static_cast<std::size_t>((kArena + kArena / 4 * sizeof(Word)) >> 30));
    return false;
  }
  base_ = reinterpret_cast<std::uint64_t>(memory);
  return true;
}

Machine::~Machine() {
  // Reports faults in work for which the program did not wait.
  if (fault_ != Fault::none) {
    std::fprintf(stderr, "emulated CUDA: something was wrong, see above\n");
    _exit(1);
  }
  const char* const path = std::getenv("TRISOUP_COUNTS");
  if (!path) return;
  std::FILE* const file = std::fopen(path, "w");
  if (!file) {
    std::perror(path);
    return;
  }
  fmt::print(file, "kernel,launches,multiply_add,special,other,shared,global,local,atomic,shared_wavefronts,sectors\n");
  for (const auto& [kernel, c] : counts_)
    fmt::print(file, "{},{},{},{},{}\n", kernel, c.launches, fmt::join(c.instructions, ","), c.shared_wavefronts,
               c.sectors);
  std::fclose(file);
}

std::uint64_t Machine::allocate(std::uint64_t bytes) {
  if (bytes > free_bytes() || !reserve_arena()) return 0;
  // Addresses are reused only after the end of the arena is reached, and allocations are separated by a free block. So
  // accesses out of bounds or after free do not hit another allocation.
  const std::uint64_t length = (bytes + kBlock - 1) / kBlock * kBlock + kBlock;
  const auto fits_at = [&](std::uint64_t from) -> std::uint64_t {
    for (const auto& [address, size] : live_) {
      if (address + size + kBlock <= from) continue;
      if (from + length <= address) break;
      from = (address + size + kBlock - 1) / kBlock * kBlock + kBlock;
    }
    return from + length <= base_ + kArena ? from : 0;
  };
  std::uint64_t at = fits_at(base_ + next_);
  if (at == 0) at = fits_at(base_);
  if (at == 0) return 0;
  next_ = at - base_ + length;
  used_ += bytes;
  live_.insert(std::ranges::upper_bound(live_, std::pair(at, bytes)), {at, bytes});
  ends_.push_back(at + bytes);
  std::fill_n(owners_ + (at - base_) / kBlock, (bytes + kBlock - 1) / kBlock,
              static_cast<std::uint32_t>(ends_.size() - 1));
  std::memset(reinterpret_cast<void*>(at), 0xfb, bytes);  // -2.6e36 as float, 4.2e9 as integer
  return at;
}

bool Machine::free(std::uint64_t address) {
  const auto found = std::ranges::find_if(live_, [&](const auto& allocation) { return allocation.first == address; });
  if (found == live_.end()) return false;
  const std::uint64_t bytes = found->second;
  std::fill_n(owners_ + (address - base_) / kBlock, (bytes + kBlock - 1) / kBlock, 0u);
  constexpr std::uint64_t kPage = 4096;
  const auto give_back = [](std::uint64_t start, std::uint64_t end) {
    start = (start + kPage - 1) / kPage * kPage, end = end / kPage * kPage;
    if (start < end) madvise(reinterpret_cast<void*>(start), end - start, MADV_DONTNEED);
  };
  give_back(address, address + bytes);
  const auto shadow = reinterpret_cast<std::uint64_t>(shadow_ + (address - base_) / 4);
  give_back(shadow, shadow + bytes / 4 * sizeof(Word));
  used_ -= bytes;
  live_.erase(found);
  return true;
}

bool Machine::holds(std::uint64_t address, std::uint64_t bytes) const {
  if (address - base_ >= kArena) return false;
  const std::uint32_t owner = owners_[(address - base_) / kBlock];
  return owner != 0 && address + bytes <= ends_[owner];
}

bool Machine::is_constant(std::uint64_t at, std::size_t bytes) const {
  auto after = constants().upper_bound(at);
  return after != constants().begin() && at + bytes <= (--after)->second;
}

void Machine::run(const Kernel& kernel, std::uint32_t groups, std::uint32_t threads, const std::byte* arguments) {
  static gpu::host::Workgroup workgroup;
  const gpu::host::CompiledKernel compiled{kernel.name, {}, false, kernel.barriers, threads, kernel.parameter_bytes,
                                           kernel.run};
  // Limits of the records. Epochs do not wrap, so very long programs fail here.
  if (kernel.shared_bytes > kSharedBytes || threads > kMostThreads || group_epoch_ > ~0u / 2) {
    std::fprintf(stderr, "emulated CUDA: kernel '%s' is too large, or there were too many\n",
                 std::string(kernel.name).c_str());
    std::abort();
  }
  kernel_ = &kernel;
  arguments_ = arguments;
  groups_ = groups;
  threads_ = threads;
  launch_epoch_ = group_epoch_;
  if (counting_) {
    counted_ = &counts_[readable(kernel.name)];
    ++counted_->launches;
    block_runs_.assign(kernel.blocks.size(), {});
    warp_ = ~0u;
  }
  for (std::uint32_t i = 0; i < groups && fault_ == Fault::none; ++i) {
    const std::uint32_t group = backwards_ ? groups - 1 - i : i;
    std::fill_n(barriers_passed_.begin(), threads, 0u);
    barrier_sites_.clear();
    std::memset(shared_, 0xfb, kernel.shared_bytes);
    workgroup.run(compiled, arguments, group);
    const auto [fewest, most] = std::minmax_element(barriers_passed_.begin(), barriers_passed_.begin() + threads);
    if (*fewest != *most) say(Fault::hazard, "some threads of the workgroup reach fewer barriers than others", 0);
    if (counting_) next_warp(), warp_ = ~0u;
    group_epoch_ += *most + 1;
  }
  launch_epoch_ = group_epoch_;
}

void Machine::barrier(std::uint32_t site, Place place) {
  const std::uint32_t passed = barriers_passed_[thread()];
  if (passed == barrier_sites_.size())
    barrier_sites_.push_back(site);
  else if (barrier_sites_[passed] != site)
    say(Fault::hazard, "waits at this barrier while others of its workgroup wait at another", place);
  gpu::host::barrier();
  ++barriers_passed_[thread()];
}

void Machine::count_block(std::uint32_t number) {
  if (thread() / 32 != warp_ || epoch() != warp_epoch_) {
    next_warp();
    warp_ = thread() / 32;
    warp_epoch_ = epoch();
  }
  ++block_runs_[number][thread() % 32];
}

void Machine::count_access(Site& site, std::uint64_t at, std::uint32_t bytes) {
  if (site.thread != thread()) site.thread = thread(), site.turn = 0;
  if (site.turn == site.turns.size()) site.turns.emplace_back();
  site.turns[site.turn++].push_back({at, bytes, thread() % 32});
}

std::uint64_t Machine::wavefronts(const std::vector<Access>& turn) {
  // A pass reads one word per bank. For accesses of 8 or 16 bytes, halves or quarters of the warp are processed in
  // turn. Two of them are combined if all pairs of neighbours, or of threads two apart, access the same address.
  const std::uint32_t words = std::max<std::uint32_t>(turn[0].bytes, 4) / 4;
  const auto paired = [&](std::uint32_t distance) {
    return std::ranges::all_of(turn, [&](const Access& a) {
      return std::ranges::any_of(turn,
                                 [&](const Access& b) { return b.lane == (a.lane ^ distance) && b.at == a.at; }) ||
             std::ranges::none_of(turn, [&](const Access& b) { return b.lane == (a.lane ^ distance); });
    });
  };
  const std::uint32_t together = words == 1 ? 32 : 32 / words * (paired(1) || paired(2) ? 2 : 1);
  std::uint64_t passes = 0;
  for (std::uint32_t from = 0; from < 32; from += together) {
    std::array<std::set<std::uint64_t>, 32> banks;
    for (const Access& a : turn)
      if (a.lane >= from && a.lane < from + together)
        for (std::uint64_t word = a.at / 4; word <= (a.at + a.bytes - 1) / 4; ++word) banks[word % 32].insert(word);
    passes += std::ranges::max_element(banks, {}, [](const auto& w) { return w.size(); })->size();
  }
  return passes;
}

void Machine::next_warp() {
  if (warp_ != ~0u) {
    for (std::size_t b = 0; b < block_runs_.size(); ++b) {
      const std::uint64_t runs = *std::ranges::max_element(block_runs_[b]);
      if (runs > 0)
        for (std::size_t u = 0; u < kUnits; ++u) counted_->instructions[u] += runs * kernel_->blocks[b][u];
      block_runs_[b] = {};
    }
    for (auto& [number, site] : shared_sites_) {
      for (auto& turn : site.turns) {
        if (!turn.empty()) counted_->shared_wavefronts += wavefronts(turn);
        turn.clear();
      }
      site.thread = ~0u;
    }
    for (auto& [number, site] : global_sites_) {
      for (auto& turn : site.turns) {
        std::set<std::uint64_t> sectors;
        for (const Access& a : turn)
          for (std::uint64_t sector = a.at / 32; sector <= (a.at + a.bytes - 1) / 32; ++sector) sectors.insert(sector);
        counted_->sectors += sectors.size();
        turn.clear();
      }
      site.thread = ~0u;
    }
  }
}

void Machine::refuse(const char* what, Place place) { say(Fault::memory, what, place); }

void Machine::hazard(const char* what, const char* space, Place place) {
  say(Fault::hazard, fmt::format("{} ({})", what, space), place);
}

void Machine::say(Fault fault, const std::string& what, Place place) {
  if (fault_ == Fault::none) fault_ = fault;
  if (!said_.emplace(std::string(kernel_->name) + what, place).second) return;
  const auto file = files().find({kernel_->module, static_cast<int>(place >> 20)});
  findings_.push_back(fmt::format("kernel '{}', {}:{}, thread {} of workgroup {}: {}", readable(kernel_->name),
                                  file == files().end() ? "?" : file->second, place & 0xfffff, thread(), group(),
                                  what));
  std::fprintf(stderr, "emulated CUDA: %s\n", findings_.back().c_str());
}

void Machine::forget_findings() {
  findings_.clear();
  said_.clear();
  fault_ = Fault::none;
}

}  // namespace trisoup::emulated_cuda

#include "ranks/launched.h"

#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include "ranks/mpi_plugin.h"

namespace trisoup::ranks {
namespace {

int number_in(const char* variable) {
  const char* const text = std::getenv(variable);
  return text ? std::atoi(text) : 0;
}

class Mpi : public Ranks {
 public:
  explicit Mpi(const TrisoupMpi& mpi) : Ranks(mpi.rank, mpi.size, mpi.library), mpi_(mpi) {}
  ~Mpi() override {
    // MPI_Finalize waits for the other ranks. Without it, the launcher would treat this process as crashed and kill the
    // others.
    if (!broken_) mpi_.finish();
  }

 protected:
  void send_numbers(std::span<const std::uint64_t> to, std::span<std::uint64_t> from) override {
    std::vector<ByteView> out;
    std::vector<std::span<std::byte>> in;
    for (const std::uint64_t& number : to) out.push_back(std::as_bytes(std::span(&number, 1)));
    for (std::uint64_t& number : from) in.push_back(std::as_writable_bytes(std::span(&number, 1)));
    send_bytes(out, in);
  }
  void send_bytes(std::span<const ByteView> to, std::span<const std::span<std::byte>> from) override {
    std::vector<const void*> out;
    std::vector<void*> in;
    std::vector<std::uint64_t> out_bytes, in_bytes;
    for (const ByteView& message : to) out.push_back(message.data()), out_bytes.push_back(message.size());
    for (const std::span<std::byte>& place : from) in.push_back(place.data()), in_bytes.push_back(place.size());
    const auto self = static_cast<std::size_t>(rank());
    std::copy(to[self].begin(), to[self].end(), from[self].begin());
    const char* const wrong = mpi_.exchange(out.data(), out_bytes.data(), in.data(), in_bytes.data());
    broken_ = wrong != nullptr;
    if (broken_) throw Error("rank {} of {}: the connection to the other ranks is broken ({})", rank(), size(), wrong);
  }

 private:
  const TrisoupMpi& mpi_;
  bool broken_ = false;
};

/// Returns the plugin files to try, in order. Open MPI and MPICH are compatible in source code only, so each has its
/// own plugin. The environment set by the launcher tells which one is in use.
std::vector<std::string> plugins() {
  std::vector<std::string> names{"trisoup-openmpi.so", "trisoup-mpich.so", "trisoup-mpi.so"};
  const bool mpich = !std::getenv("OMPI_COMM_WORLD_SIZE") && !std::getenv("PMIX_RANK") && std::getenv("PMI_RANK");
  if (mpich) std::swap(names[0], names[1]);
  return names;
}

}  // namespace

int launched_size() {
  // In this order: Open MPI; MPICH, Intel MPI and srun --mpi=pmi2; srun with any MPI.
  for (const char* variable : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"})
    if (const int size = number_in(variable); size > 0) return size;
  return 1;
}

std::filesystem::path folder_of_program() {
  std::error_code ignored;
  return std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path();
}

std::unique_ptr<Ranks> open_launched(const std::filesystem::path& programs) {
  if (launched_size() <= 1) return alone();
  const auto says = [](const char* variable) { return std::getenv(variable) != nullptr; };
  if (says("SLURM_STEP_NUM_TASKS") && !says("PMIX_RANK") && !says("PMI_RANK") && !says("OMPI_COMM_WORLD_SIZE"))
    throw Error(
        "srun started {} processes without an MPI; run srun with --mpi=pmix for Open MPI or --mpi=pmi2 for MPICH, or "
        "set `by_itself`",
        launched_size());
  std::string why = "this build has none";
  for (const std::string& name : plugins()) {
    const std::filesystem::path file = programs / name;
    std::error_code ignored;
    if (!std::filesystem::exists(file, ignored)) continue;
    // RTLD_GLOBAL is needed because components that an MPI library loads resolve symbols of the library. Never closed,
    // because MPI libraries leave threads and handlers behind.
    void* const library = ::dlopen(file.c_str(), RTLD_NOW | RTLD_GLOBAL);
    if (!library) {
      why = ::dlerror();
      continue;
    }
    const auto open = reinterpret_cast<TrisoupMpiOpen>(::dlsym(library, "trisoup_mpi_open"));
    const char* error = "the plugin belongs to another build";
    const TrisoupMpi* const mpi = open ? open(&error) : nullptr;
    if (!mpi || mpi->version != TRISOUP_MPI_PLUGIN_VERSION)
      throw Error("{}: MPI does not start ({}); check the MPI installation", file.string(), error);
    if (mpi->size != launched_size())
      throw Error(
          "{}: the launcher started {} processes, but {} sees {}; use the launcher of the same MPI (mpirun of Open "
          "MPI, mpiexec of MPICH)",
          file.string(), launched_size(), mpi->library, mpi->size);
    return std::make_unique<Mpi>(*mpi);
  }
  throw Error(
      "{} processes were started, but no MPI plugin could be loaded ({}); install libopenmpi-dev or libmpich-dev and "
      "build again, or start one process",
      launched_size(), why);
}

}  // namespace trisoup::ranks

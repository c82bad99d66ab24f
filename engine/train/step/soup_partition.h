// Which triangles of a soup this process has, and what processes that share a soup (ranks) exchange in a step. The base
// class is the common case, one process with the whole soup; SharedSoup (shared_soup.h) is a part of a soup.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "args/types.h"
#include "gpu/device.h"
#include "ranks/ranks.h"
#include "soup/soup.h"

namespace trisoup::train {

/// Triangles first .. last - 1.
struct TriangleRange {
  std::uint32_t first = 0, last = 0;
  std::uint32_t count() const { return last - first; }
};

/// Divides triangles into one range for each rank, of about as many bytes. [ranks]
std::vector<TriangleRange> divided(std::span<const soup::TextureEntry> table, int ranks);

/// Where shade() and shade_backward() find what a pixel shows, and where its gradients go.
struct ShadedFrom {
  gpu::Address hits = 0, textures = 0, lattice = 0;
  gpu::Address places = 0, ranks = 0;  // order of the gradients of a pixel in `sorted`
  gpu::Address sorted = 0;
  bool has_levels = true;  // textures have all their samples, so that a coarser level can be read from them
};

/// Triangles of a soup that the triangles of a new one inherit from.
struct Parents {
  std::vector<std::vector<std::uint32_t>> needed;  // by each rank, ascending, each once; empty with one rank. [ranks]
  std::vector<kernels::Texture>
      rows;  // their texture table, in a pool of their own; empty: the soup's own table and pool
  std::vector<std::uint32_t> numbers;  // for each new triangle of this rank: its parent's row. [own]
  std::uint64_t samples = 0;           // in such a pool
};

class SoupPartition {
 public:
  enum class Outcome {
    done,
    overflow,  // the tile lists of some rank were too small: nothing has changed; do the step again
    stopped    // a rank was asked to stop: nothing has changed
  };

  virtual ~SoupPartition() = default;
  virtual int rank() const { return 0; }
  virtual int size() const { return 1; }
  /// Whether this rank writes the files of all.
  bool is_first() const { return rank() == 0; }
  /// The range of this rank.
  TriangleRange own(std::span<const soup::TextureEntry> table) const {
    return divided(table, size())[static_cast<std::size_t>(rank())];
  }

  /// Result of the last Step::visibility().
  virtual Outcome outcome() const { return Outcome::done; }
  /// Whether a step is a list of commands without exchanges in between.
  virtual bool can_replay() const { return true; }
  /// Asks all ranks to stop in their next Step::visibility(). A process by itself stops between steps.
  virtual void ask_to_stop(bool) {}

  // Parts of a step, for the batch in the buffers. `soup`: addresses of the soup itself.
  virtual void agree_on_winners() {}
  virtual ShadedFrom shaded_from(const ShadedFrom& soup, bool /*coarser*/) { return soup; }
  virtual void share_colours() {}
  virtual ShadedFrom gradients_to(const ShadedFrom& soup) const { return soup; }
  virtual void share_gradients() {}

  /// parents: of every triangle of the new soup, which is divided into `ranges`.
  virtual Parents parents_of(std::span<const std::uint32_t> parents, std::span<const TriangleRange> /*ranges*/) const {
    return {.needed = {}, .rows = {}, .numbers = {parents.begin(), parents.end()}};
  }
  /// The samples that this rank needs of a pool (logits or a moment) whose parts the ranks have. Frees `pool` before
  /// they arrive.
  virtual gpu::Buffer fetch(const Parents&, gpu::Buffer pool) { return pool; }

  /// All parts one after the other on the first rank; empty on the others.
  virtual ranks::Bytes gather_on_first(ranks::ByteView mine) { return {mine.begin(), mine.end()}; }
  /// The part of this rank of the first rank's bytes, `size` for each lattice sample of all triangles.
  virtual ranks::Bytes scatter_from_first(ranks::ByteView all, std::uint64_t /*size*/) {
    return {all.begin(), all.end()};
  }
  /// Throws Error if what all ranks compute, vertices and MLP, differs between them.
  virtual void compare() {}
};

/// The partition of a process by itself.
SoupPartition& whole_soup();

}  // namespace trisoup::train

// Depth of every pixel of small pictures of the photographs, by multi-view stereo on a device.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "gpu/device.h"
#include "scene/scene.h"

namespace trisoup::scene {

/// The planes of one view's pixels, row by row (common/patch_match.h).
struct DepthMap {
  Camera camera;                          // of the small picture
  std::vector<std::uint32_t> neighbours;  // views, at most 32
  double pixel_step = 0;                  // change of inverse depth that moves a point by about a pixel in a neighbour
  std::vector<glm::vec4> planes;          // inverse depth, its change per pixel along x and y, cost
  std::vector<std::uint32_t> agreeing;    // bit k: neighbours[k] has the same point
};

struct DepthMapOptions {
  /// Pixels of all small pictures together, which set the time: about half a minute for a million on two cores.
  std::size_t pixels = 8'000'000;
  int longest_side = 320, shortest_long_side = 144;  // bounds of the small pictures' longer side, pixels
  std::size_t neighbours = 8;                        // of a view, at most 32
  std::function<void(int done, int total)> progress;
};

/// DepthMap::agreeing of planes from measured depths (measured_planes.h): they need no neighbour.
inline constexpr std::uint32_t kMeasured = ~0u;

/// Largest cost of a plane that counts.
inline constexpr float kLargestPlaneCost = 0.6f;

/// Finds depths by PatchMatch (Galliani, Lasinger, Schindler, "Massively parallel multiview stereopsis by surface
/// normal diffusion", ICCV 2015), at a quarter, half and the whole of the size, with the neighbours' planes as a
/// further witness (Xu and Tao, "Multi-scale geometric consistency guided multi-view stereo", CVPR 2019). Where the
/// whole size finds none, as in plain places, the planes of half the size stay. Unsupported planes do not count
/// (support.h). Where there are too many views for `pixels`, only views spread evenly over the others have a map; the
/// maps of the rest are empty. views: normalised coordinates, with their photographs. points: sparse points, which tell
/// neighbours and the range of depths; may be empty. The result is the same for any device of a backend. Throws Error
/// if the device fails. [views]
std::vector<DepthMap> depth_maps(gpu::Device& gpu, std::span<const View> views, const Points& points,
                                 const DepthMapOptions& options);

/// Returns the finer map, with the coarser one's planes where no two neighbours agree with its own: there the patches
/// of a finer level may be plain, while those of a coarser one reach the next edge. Both: of one view, with the same
/// neighbours. An empty map changes nothing.
DepthMap merged(DepthMap finer, const DepthMap& coarser);

}  // namespace trisoup::scene

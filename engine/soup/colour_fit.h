// Fits a colour to each texture sample so that pictures with these colours alone are as close as possible to given
// pictures of the model.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "args/types.h"
#include "soup/soup.h"

namespace trisoup::soup {

/// Least squares, over all pixels that show a triangle, of the colour interpolated between samples minus the colour of
/// the picture, in display values. Interpolation is that of an atlas (atlas.h): bilinear, and linear along the
/// diagonal. Samples that few or no pixels show follow their neighbours' difference from the MLP's mean colour over the
/// views that show the triangle. The first solution interpolates display values, so the problem is linear. glTF viewers
/// interpolate light: the second one corrects what differs then (a Gauss-Newton step). The result does not depend on
/// the number of threads.
///
/// Calls: add() of all pictures, solve(), the same add() again, solve(), colours().
class ColourFit {
 public:
  /// model: must outlive this object. eyes: positions of the cameras by index, normalised coordinates; not empty. Needs
  /// 56 bytes per sample.
  ColourFit(const Model& model, std::vector<glm::vec3> eyes);

  /// Adds pixels of a picture. view: index of its camera. hits: the visible fragment of each pixel; colours: [hits][3],
  /// display values 0..1.
  void add(std::uint32_t view, std::span<const kernels::Hit> hits, std::span<const float> colours);

  void solve();
  /// The RGB colour of every sample, [samples][3], display values 0..255.
  std::vector<std::uint8_t> colours() const;

 private:
  static constexpr std::size_t kViews = 4;  // of a triangle that are remembered: those with the most pixels
  struct Seen {
    std::uint32_t view = 0, pixels = 0;
  };
  /// Normal equations: a sample's own coefficient, and right-hand side. `couplings`: of sample (x, y) with (x + 1, y),
  /// (x, y + 1) and (x + 1, y + 1), and of (x + 1, y) with (x, y + 1).
  struct Row {
    float own = 0;
    std::array<float, 4> couplings{};
    glm::vec3 right{0.0f};
  };
  struct Pixel {
    std::uint32_t triangle;
    float b0, b1;
    glm::vec3 colour;
  };

  void add_pixel(const Pixel& pixel);
  void remember(std::uint32_t triangle, Seen seen);
  void take_mean_colours(std::size_t triangle, std::span<const std::uint32_t> around);
  void fit(std::size_t triangle);

  const Model& model_;
  std::vector<glm::vec3> eyes_;
  bool corrects_ = false;                       // the first solution is there
  std::vector<glm::vec3> vertices_;             // normalised
  std::vector<Row> rows_;                       // [samples]
  std::vector<glm::vec3> colours_, light_;      // [samples] the solution, display values, and its light
  std::vector<std::array<Seen, kViews>> seen_;  // [T]
  std::vector<std::uint32_t> first_;            // of a triangle's pixels in `sorted_`; [T + 1]
  std::vector<Pixel> sorted_;
};

}  // namespace trisoup::soup

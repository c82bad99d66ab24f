// What a model's colours become in photographs that no training has seen. A model has the mean exposure of its
// photographs; a camera that measures light shows a place like its neighbours did. Test views are compared so.
#pragma once

#include <array>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "image/image.h"
#include "scene/scene.h"
#include "soup/soup.h"

namespace trisoup::train {

/// Exposures of the training photographs. gains: of each view (Trainer::exposures()); empty: all 0. Returns none if all
/// are 0.
std::vector<soup::PhotographExposure> photograph_exposures(const std::vector<scene::View>& views,
                                                           std::span<const soup::ExposureGrid> gains);

/// Gains of the views that a model was trained on, by name; 0 for others. [views]
std::vector<soup::ExposureGrid> gains_of(const soup::Model& model, const std::vector<scene::View>& views);

/// The camera of each view (ViewExposures), from 0. [views]
std::vector<std::uint32_t> cameras_of(const std::vector<scene::View>& views);

/// Foretells exposures from those of the training photographs of the same camera: their mean plus a Gaussian process
/// over position and viewing direction (kriging; Rasmussen and Williams 2006), of the nearest photographs. Its width
/// and noise are those that foretell the training photographs best, each from the others; there is no such process if
/// the mean does so better. Views are of one camera if folder and proportions are the same, and the angle of view
/// within 10 %; a view in a folder without training photographs is by the only camera with its lens. With several
/// cameras their means are shrunk by what photographs of one camera differ (James and Stein 1961).
class ViewExposures {
 public:
  ViewExposures() = default;
  /// photographs: in the coordinates of the views that at() is asked about.
  explicit ViewExposures(std::span<const soup::PhotographExposure> photographs);
  /// Of a model, for views in the coordinates of `normalisation`.
  ViewExposures(const soup::Model& model, const scene::Normalisation& normalisation);
  bool empty() const { return groups_.empty(); }
  /// Gains of a view, whose own photograph is not looked at; a training photograph's own. 0 for a camera that has taken
  /// no training photograph.
  soup::ExposureGrid at(const scene::View& view) const;

 private:
  using Grid = std::array<glm::dvec3, soup::ExposureGrid().size()>;
  struct Group {
    std::vector<soup::PhotographExposure> photographs;
    Grid centre{}, mean{};        // mean of the gains; the same after shrinkage
    double spread = 1;            // of the positions, a distance
    double width = 0, noise = 0;  // of the process; width 0: none
  };
  /// What the process adds to `mean`, from all photographs but `at` itself.
  static Grid beyond(const Group& group, const Grid& mean, const soup::PhotographExposure& at, double width,
                     double noise);
  static void choose_process(Group& group);
  std::vector<Group> groups_;
};

/// The gains of every pixel, [height][width].
std::vector<glm::vec3> gains_at_pixels(const soup::ExposureGrid& gain, int width, int height);

/// Applies gains to a picture, but to its background. colour: [height][width][3], 0..1.
void expose(std::vector<float>& colour, int width, int height, const soup::ExposureGrid& gain,
            const glm::vec3& background);

/// The photograph in the scene's exposure, to be seen beside a model: without its gain. Black and white stay.
Image in_scene_exposure(Image photograph, const soup::ExposureGrid& gain);

}  // namespace trisoup::train

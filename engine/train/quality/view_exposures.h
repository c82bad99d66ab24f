// What a model's colours become in photographs that no training has seen. A model has the mean exposure of its
// photographs; a camera that measures light shows a place like its neighbours did. Test views are compared so.
#pragma once

#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "image/image.h"
#include "scene/scene.h"
#include "soup/soup.h"

namespace trisoup::train {

/// Exposures of the training photographs. gains: of each view (Trainer::exposures()), the fourth number unused; empty:
/// all 0. Returns none if all are 0.
std::vector<soup::PhotographExposure> photograph_exposures(const std::vector<scene::View>& views,
                                                           std::span<const glm::vec4> gains);

/// Gains of the views that a model was trained on, by name; 0 for others. [views]
std::vector<glm::vec3> gains_of(const soup::Model& model, const std::vector<scene::View>& views);

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
  glm::vec3 at(const scene::View& view) const;

 private:
  struct Group {
    std::vector<soup::PhotographExposure> photographs;
    glm::dvec3 centre{0.0}, mean{0.0};  // mean of the gains; the same after shrinkage
    double spread = 1;                  // of the positions, a distance
    double width = 0, noise = 0;        // of the process; width 0: none
  };
  /// What the process adds to `mean`, from all photographs but `at` itself.
  static glm::dvec3 beyond(const Group& group, const glm::dvec3& mean, const soup::PhotographExposure& at, double width,
                           double noise);
  static void choose_process(Group& group);
  std::vector<Group> groups_;
};

/// Applies gains to a picture, but to its background. colour: [height][width][3], 0..1.
void expose(std::vector<float>& colour, const glm::vec3& gain, const glm::vec3& background);

/// The photograph in the scene's exposure, to be seen beside a model: without its gain. Black and white stay.
Image in_scene_exposure(Image photograph, const glm::vec3& gain);

}  // namespace trisoup::train

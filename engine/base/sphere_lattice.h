// Directions spread evenly over a sphere.
#pragma once

#include <glm/glm.hpp>

namespace trisoup {

/// Direction `i` of `count` (Fibonacci lattice). Unit length.
glm::dvec3 sphere_lattice(int i, int count);

}  // namespace trisoup

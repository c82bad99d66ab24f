// Adam (Kingma and Ba 2015) and VectorAdam (Ling et al. 2022), beta 0.9 and 0.999, epsilon 1e-8.

/// Returns the step. rate: learning rate / (1 - 0.9^t); second: 1 / sqrt(1 - 0.999^t); t: steps since the moments were
/// zero, starting at 1.
FN real adam(real gradient, real rate, real second, INOUT(real) m, INOUT(real) v) {
  m = real(0.9) * m + real(0.1) * gradient;
  v = real(0.999) * v + real(0.001) * gradient * gradient;
  return rate * m / (sqrt(v) * second + real(1e-8));
}

/// Uses one second moment for the three coordinates of a vertex, so the step does not depend on the axes.
FN vec3 vector_adam(vec3 gradient, real rate, real second, INOUT(vec3) m, INOUT(real) v) {
  m = real(0.9) * m + real(0.1) * gradient;
  v = real(0.999) * v + real(0.001) * dot(gradient, gradient);
  return rate * m / (sqrt(v) * second + real(1e-8));
}

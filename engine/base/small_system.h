// Solves small systems of linear equations.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace trisoup {

template <std::size_t N>
using SquareMatrix = std::array<std::array<double, N>, N>;

/// Solves matrix x = right for a symmetric positive definite matrix (Cholesky). Unknowns without a positive pivot are
/// 0.
template <std::size_t N>
std::array<double, N> solve_symmetric(SquareMatrix<N> matrix, std::array<double, N> right) {
  for (std::size_t j = 0; j < N; ++j) {
    for (std::size_t k = 0; k < j; ++k) matrix[j][j] -= matrix[j][k] * matrix[j][k];
    const double pivot = matrix[j][j] > 0 ? std::sqrt(matrix[j][j]) : 0.0;
    matrix[j][j] = pivot;
    for (std::size_t i = j + 1; i < N; ++i) {
      for (std::size_t k = 0; k < j; ++k) matrix[i][j] -= matrix[i][k] * matrix[j][k];
      matrix[i][j] = pivot > 0 ? matrix[i][j] / pivot : 0.0;
    }
    for (std::size_t k = 0; k < j; ++k) right[j] -= matrix[j][k] * right[k];
    right[j] = pivot > 0 ? right[j] / pivot : 0.0;
  }
  for (std::size_t j = N; j-- > 0;) {
    for (std::size_t k = j + 1; k < N; ++k) right[j] -= matrix[k][j] * right[k];
    right[j] = matrix[j][j] > 0 ? right[j] / matrix[j][j] : 0.0;
  }
  return right;
}

}  // namespace trisoup

// SPDX-License-Identifier: GPL-3.0-or-later
/// The linear equations of one step of a Relaxation: three unknowns for each vertex that moves.
#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <vector>

namespace tolvol {

/// A symmetric matrix and a right-hand side.
class DampedSystem {
 public:
  /// Starts with zeros for so many vertices.
  void start(std::size_t vertices);
  /// Adds a vector to the right-hand side of a vertex.
  void add(std::size_t vertex, const glm::dvec3& pull) {
    for (int x = 0; x < 3; ++x) right_[3 * vertex + x] += pull[x];
  }
  /// Adds c * r * r^T to the block of two vertices. Only those with column <= row are read.
  void add(std::size_t row, std::size_t column, double c, const glm::dvec3& r) {
    for (int y = 0; y < 3; ++y) {
      double* const at = &matrix_[(3 * column + y) * right_.size() + 3 * row];
      for (int x = 0; x < 3; ++x) at[x] += c * r[x] * r[y];
    }
  }
  /// Solves after adding the diagonal to itself `damping` times, with a share of its mean. Returns false if the matrix
  /// is not positive definite. O(n^3 / 6) for n unknowns.
  bool solve(double damping);
  /// The solution for a vertex.
  glm::dvec3 operator[](std::size_t vertex) const {
    return {solution_[3 * vertex], solution_[3 * vertex + 1], solution_[3 * vertex + 2]};
  }

 private:
  std::vector<double> matrix_, factor_;  ///< Column by column, of which the lower triangle counts.
  std::vector<double> right_, solution_;
};

}  // namespace tolvol

// SPDX-License-Identifier: GPL-3.0-or-later
#include "decimation/refinement/damped_system.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "base/simd.h"

namespace {

using namespace tolvol;
using glm::dvec3;

TEST(DampedSystem, SolvesWithTheDampedDiagonal) {
  constexpr std::size_t kVertices = 5, n = 3 * kVertices;
  for (const double damping : {0.0, 1e-2, 3.0}) {
    std::minstd_rand random(7);
    const auto uniform = [&] { return std::uniform_real_distribution(-1.0, 1.0)(random); };
    std::vector<std::vector<double>> matrix(n, std::vector<double>(n));
    std::vector<double> right(n);
    DampedSystem system;
    for (int again = 0; again < 2; ++again) {  // Nothing of the first time may be left.
      for (auto& row : matrix) row.assign(n, 0);
      right.assign(n, 0);
      system.start(kVertices);
      for (int term = 0; term < 40; ++term) {
        const dvec3 r(uniform(), uniform(), uniform());
        double weights[kVertices];
        for (double& w : weights) w = uniform();
        for (std::size_t i = 0; i < kVertices; ++i) {
          system.add(i, weights[i] * r);
          for (int x = 0; x < 3; ++x) right[3 * i + x] += weights[i] * r[x];
          for (std::size_t j = 0; j < kVertices; ++j) {
            if (j <= i) system.add(i, j, weights[i] * weights[j], r);
            for (int x = 0; x < 3; ++x) {
              for (int y = 0; y < 3; ++y) matrix[3 * i + x][3 * j + y] += weights[i] * weights[j] * r[x] * r[y];
            }
          }
        }
      }
    }
    double mean = 0;
    for (std::size_t i = 0; i < n; ++i) mean += matrix[i][i] / n;
    for (std::size_t i = 0; i < n; ++i) matrix[i][i] += damping * (matrix[i][i] + 0.1 * mean);
    ASSERT_TRUE(system.solve(damping));
    for (std::size_t i = 0; i < n; ++i) {
      double sum = 0;
      for (std::size_t j = 0; j < n; ++j) sum += matrix[i][j] * system[j / 3][static_cast<int>(j % 3)];
      EXPECT_NEAR(sum, right[i], 1e-10);
    }
  }
}

TEST(DampedSystem, RefusesWhatIsNotPositiveDefinite) {
  DampedSystem system;
  system.start(1);
  EXPECT_FALSE(system.solve(1)) << "nothing was added";
  system.add(0, 0, 1, dvec3(1, 2, 3));
  EXPECT_FALSE(system.solve(0)) << "one direction alone";
  EXPECT_TRUE(system.solve(1e-2));
  system.start(1);
  system.add(0, 0, -1, dvec3(1, 2, 3));
  EXPECT_FALSE(system.solve(1e-2));
}

TEST(DampedSystem, InstructionsDoNotChangeABit) {
  constexpr std::size_t kVertices = 13;
  std::minstd_rand random(11);
  const auto uniform = [&] { return std::uniform_real_distribution(-1.0, 1.0)(random); };
  DampedSystem system;
  system.start(kVertices);
  for (int term = 0; term < 200; ++term) {
    const dvec3 r(uniform(), uniform(), uniform());
    double weights[kVertices];
    for (double& w : weights) w = uniform();
    for (std::size_t i = 0; i < kVertices; ++i) {
      system.add(i, weights[i] * r);
      for (std::size_t j = 0; j <= i; ++j) system.add(i, j, weights[i] * weights[j], r);
    }
  }
  const auto solved = [&] {
    EXPECT_TRUE(system.solve(1e-2));
    std::vector<dvec3> solution;
    for (std::size_t i = 0; i < kVertices; ++i) solution.push_back(system[i]);
    return solution;
  };
  const std::vector<dvec3> fastest = solved();
  const Simd best = simd_path();
  simd_path() = Simd::portable;
  EXPECT_EQ(solved(), fastest);
  simd_path() = best;
}

}  // namespace

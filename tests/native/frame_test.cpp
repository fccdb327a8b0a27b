// SPDX-License-Identifier: GPL-3.0-or-later
#include "geometry/frame.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <random>

#include "base/errors.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;

glm::dmat4 sheared() {
  glm::dmat4 m(1);
  m[0] = {2, 0.3, 0, 0}, m[1] = {0.5, -1, 0.2, 0}, m[2] = {0, 0.1, 0.01, 0}, m[3] = {1000, -50, 3, 1};
  return m;
}

TEST(Frame, ScalesToAboutOneAtAnySize) {
  for (const double size : {1e-30, 1e-6, 1.0, 123.0, 1e30}) {
    const dvec3 centre(5 * size, -size, 0);
    const Frame frame(Box{centre - size, centre + size});
    const double radius = glm::length(frame.from_world(centre + size));
    EXPECT_GT(radius, 0.5);
    EXPECT_LE(radius, 1.0 + 1e-12);
    EXPECT_EQ(std::exp2(std::round(std::log2(frame.scale()))), frame.scale()) << "a power of two";
  }
}

TEST(StoredSpace, StoredPositionsComeBack) {
  std::mt19937 engine(1);
  std::normal_distribution<double> normal;
  for (const Storage storage : {Storage::float32, Storage::float64}) {
    const StoredSpace space = StoredSpace(sheared(), storage).in(Frame(Box{{990, -60, 0}, {1010, -40, 6}}));
    std::vector<dvec3> points;
    for (int i = 0; i < 1000; ++i)
      points.push_back(rounded_to_float32(dvec3(normal(engine), normal(engine), normal(engine))));
    const double step = space.storage_step(points), error = space.mapping_error(points);
    for (const dvec3& p : points) {
      const dvec3 q = space.frame(p) + 1e-4 * dvec3(normal(engine), normal(engine), normal(engine));
      const dvec3 back = space.frame(space.store(q));
      EXPECT_LE(glm::length(back - q), step + 1e3 * error);
      if (storage == Storage::float32) {
        // One coordinate at a time and through memory, which no compiler folds away.
        const dvec3 s = space.store(q);
        for (int k = 0; k < 3; ++k) {
          const volatile float single = static_cast<float>(s[k]);
          ASSERT_EQ(s[k], single) << "what is stored is a float32, bit for bit";
        }
      }
    }
  }
}

TEST(StoredSpace, MappingErrorCoversQuadruplePrecision) {
  using Quad = boost::multiprecision::cpp_bin_float_quad;
  std::mt19937 engine(2);
  std::normal_distribution<double> normal;
  const glm::dmat4 m = sheared();
  const Frame frame(Box{{990, -60, 0}, {1010, -40, 6}});
  const StoredSpace space = StoredSpace(m, Storage::float64).in(frame);
  std::vector<dvec3> points;
  for (int i = 0; i < 1000; ++i) points.emplace_back(100 * normal(engine), 1e4 * normal(engine), normal(engine));
  const double bound = space.mapping_error(points);
  double worst = 0;
  for (const dvec3& p : points) {
    const dvec3 got = space.frame(p);
    for (int row = 0; row < 3; ++row) {
      Quad exact = Quad(m[3][row]) - Quad(frame.centre()[row]);
      for (int column = 0; column < 3; ++column) exact += Quad(m[column][row]) * Quad(p[column]);
      worst = std::max(worst, std::abs(static_cast<double>(Quad(got[row]) - exact * Quad(frame.scale()))));
    }
  }
  EXPECT_LE(worst, bound);
  EXPECT_GE(worst, bound / 100) << "the bound says nothing when it is that wide";
}

TEST(StoredSpace, MappingErrorCoversAllThatAMeshMayReach) {
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> u(-1, 1);
  const StoredSpace space = StoredSpace(sheared(), Storage::float64).in(Frame(Box{{990, -60, 0}, {1010, -40, 6}}));
  const std::vector<dvec3> none;
  for (const double reach : {0.5, 1.0, 4.0}) {
    const double bound = space.mapping_error(none, reach);
    double largest = 0;
    for (int i = 0; i < 1000; ++i) {
      const dvec3 stored = space.store(reach * dvec3(u(engine), u(engine), u(engine)));
      const double error = space.mapping_error({&stored, 1});
      EXPECT_LE(error, bound);
      largest = std::max(largest, error);
    }
    EXPECT_GT(largest, 0.7 * bound);
    EXPECT_GT(space.mapping_error(none, 2 * reach), 1.01 * bound) << "the reach counts";
    const dvec3 far = space.store(dvec3(100 * reach));
    EXPECT_GE(space.mapping_error({&far, 1}, reach), space.mapping_error({&far, 1})) << "the points count";
    EXPECT_GT(space.mapping_error({&far, 1}, reach), bound);
  }
}

TEST(StoredSpace, AFarOriginCostsNothing) {
  const Box box{{-3, -2, -5}, {3, 2, 5}};
  const std::vector<dvec3> ends{box.lower, box.upper};
  const double near = StoredSpace(glm::dmat4(1), Storage::float64).in(Frame(box)).mapping_error(ends);
  for (const double far : {1e5, 1e10, 1e15}) {
    const dvec3 away(far, -2 * far, 0);
    const auto error = [](const glm::dmat4& to_world, const Box& world, const std::vector<dvec3>& stored) {
      return StoredSpace(to_world, Storage::float64).in(Frame(world)).mapping_error(stored);
    };
    glm::dmat4 there(1), back(1);
    there[3] = glm::dvec4(away, 1), back[3] = glm::dvec4(-away, 1);
    const Box moved{box.lower + away, box.upper + away};
    const std::vector<dvec3> moved_ends{moved.lower, moved.upper};
    EXPECT_LE(error(glm::dmat4(1), moved, moved_ends), 1.1 * near);
    EXPECT_LE(error(there, moved, ends), 1.1 * near);
    EXPECT_LE(error(back, box, moved_ends), 1.1 * near);
  }
}

TEST(StoredSpace, RefusesWhatIsNotInvertible) {
  glm::dmat4 flat(1), projective(1), nan(1);
  flat[2] = {1, 1, 0, 0}, flat[1] = {1, -1, 0, 0};
  projective[0][3] = 0.1;
  nan[3][0] = std::numeric_limits<double>::quiet_NaN();
  for (const glm::dmat4& m : {flat, projective, nan, glm::dmat4(0)}) {
    EXPECT_THROW(StoredSpace(m, Storage::float32), InvalidInput);
  }
  glm::dmat4 tiny(1e-30);
  tiny[3][3] = 1;
  EXPECT_NO_THROW(StoredSpace(tiny, Storage::float32));
}

TEST(ReferenceSize, LongestDiagonalAfterTheMatrixOfUsedVerticesOnly) {
  TriangleMesh mesh = shapes::box(1);
  mesh.vertices.emplace_back(100, 100, 100);  // unused
  EXPECT_DOUBLE_EQ(longest_diagonal(mesh.vertices, mesh.triangles, glm::dmat4(1)), std::sqrt(3.0));
  glm::dmat4 shear(1);
  shear[1][0] = -3;  // x -= 3 y: the diagonal (1, -1, 1) becomes the longest
  EXPECT_DOUBLE_EQ(longest_diagonal(mesh.vertices, mesh.triangles, shear), std::sqrt(16.0 + 1 + 1));
  for (dvec3& p : mesh.vertices) p = dvec3(1);
  EXPECT_THROW(longest_diagonal(mesh.vertices, mesh.triangles, glm::dmat4(1)), InvalidInput);
}

}  // namespace

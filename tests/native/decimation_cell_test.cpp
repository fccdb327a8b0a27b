// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "base/errors.h"
#include "crossing_judge.h"
#include "decimation/decimation.h"
#include "many.h"
#include "measure/hausdorff.h"
#include "shapes.h"

namespace tolvol {
namespace {

using glm::dvec3;
using glm::uvec3;

constexpr double kFar = std::numeric_limits<double>::infinity();

struct Corner {
  double x, y, z;
  auto operator<=>(const Corner&) const = default;
};

/// Triangles by the positions of their corners.
using Soup = std::vector<std::array<dvec3, 3>>;

Soup soup_of(std::span<const dvec3> vertices, std::span<const uvec3> triangles) {
  Soup soup;
  for (const uvec3& t : triangles) soup.push_back({vertices[t.x], vertices[t.y], vertices[t.z]});
  return soup;
}

TriangleMesh mesh_of(const Soup& soup) {
  TriangleMesh mesh;
  std::map<Corner, std::uint32_t> numbers;
  for (const auto& corners : soup) {
    uvec3 t;
    for (int k = 0; k < 3; ++k) {
      const dvec3& p = corners[k];
      const auto [found, made] = numbers.try_emplace({p.x, p.y, p.z}, static_cast<std::uint32_t>(numbers.size()));
      if (made) mesh.vertices.push_back(p);
      t[k] = found->second;
    }
    mesh.triangles.push_back(t);
  }
  return mesh;
}

Box box_of(const std::array<dvec3, 3>& corners) {
  Box box;
  for (const dvec3& p : corners) box.add(p);
  return box;
}

bool is_inside(const std::array<dvec3, 3>& corners, const Box& cell) {
  return strictly_inside(corners[0], cell) && strictly_inside(corners[1], cell) && strictly_inside(corners[2], cell);
}

StoredSpace space() { return StoredSpace(glm::dmat4(1), Storage::float64); }

/// Decimates a mesh in each of some cells that together are all of space, and puts the results together.
Soup round(const Soup& mesh, const Soup& reference, double tolerance, const std::vector<Box>& cells,
           DecimationOptions options = {}) {
  Soup result;
  std::vector<bool> stands(mesh.size(), true);
  for (const Box& cell : cells) {
    Soup near, around;
    std::vector<bool> inside;
    for (std::size_t i = 0; i < mesh.size(); ++i) {
      if (!meet(box_of(mesh[i]), cell)) continue;
      near.push_back(mesh[i]);
      inside.push_back(is_inside(mesh[i], cell));
      if (inside.back()) stands[i] = false;
    }
    const Box reach{cell.lower - tolerance, cell.upper + tolerance};
    for (const auto& corners : reference) {
      if (meet(box_of(corners), reach)) around.push_back(corners);
    }
    if (near.empty()) continue;
    const TriangleMesh input = mesh_of(near), other = mesh_of(around);
    const ToleranceVolume volume(other.vertices, other.triangles, space(), tolerance);
    options.cell = cell;
    const DecimationResult r = decimate(input.vertices, input.triangles, space(), &volume, options);
    EXPECT_EQ(r.uncovered.faces, 0u);
    const Soup left = soup_of(r.vertices, r.triangles);
    std::size_t still = 0;
    for (std::size_t i = 0; i < left.size(); ++i) {
      const std::uint32_t source = r.triangle_source[i];
      if (inside[source]) {
        EXPECT_TRUE(is_inside(left[i], cell)) << "what was inside stays inside";
        result.push_back(left[i]);
      } else {
        EXPECT_EQ(left[i], near[source]) << "what reaches out stands still";
        ++still;
      }
    }
    EXPECT_EQ(still, static_cast<std::size_t>(std::ranges::count(inside, false)));
  }
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    if (stands[i]) result.push_back(mesh[i]);
  }
  return result;
}

/// Two cells, below and above a plane.
std::vector<Box> halves(int axis, double at) {
  Box below{dvec3(-kFar), dvec3(kFar)}, above = below;
  below.upper[axis] = above.lower[axis] = at;
  return {below, above};
}

void expect_within(const Soup& mesh, const Soup& reference, double tolerance) {
  const TriangleMesh a = mesh_of(mesh), b = mesh_of(reference);
  EXPECT_LE(hausdorff(a, b, {.bound = tolerance}).upper, tolerance) << "forward";
  EXPECT_LE(hausdorff(b, a, {.bound = tolerance}).upper, tolerance) << "backward";
}

TEST(DecimationCell, ResultsOfCellsAreOneProvedMesh) {
  const TriangleMesh sphere = shapes::sphere(across(20));
  const Soup reference = soup_of(sphere.vertices, sphere.triangles);
  constexpr double kTolerance = 0.02;
  Soup mesh = reference;
  std::size_t before = mesh.size();
  for (const auto effort : {DecimationOptions::Effort::fast, DecimationOptions::Effort::thorough}) {
    for (int axis = 0; axis < 3; ++axis) {
      mesh = round(mesh, reference, kTolerance, halves(axis, 0.1 * (axis - 1)), {.effort = effort});
      expect_within(mesh, reference, kTolerance);
    }
    EXPECT_LT(mesh.size(), 3 * before / 4) << "each round goes on where the one before stopped";
    before = mesh.size();
  }
  const TriangleMesh result = mesh_of(mesh);
  EXPECT_TRUE(crossings_by_cgal(result).empty());
}

/// Two sheets face each other across a gap of almost twice the tolerance. Each alone covers less than its half of the
/// gap, and the zigzag of its rim reaches farther than the pieces do into which its half is cut.
TEST(DecimationCell, HoldsWhatCoversTheRestOfAPiece) {
  constexpr double kTolerance = 0.2;
  constexpr int kTeeth = 160;
  const Soup reference = {{dvec3(-1, -1, 0), dvec3(1, -1, 0), dvec3(1, 1, 0)},
                          {dvec3(-1, -1, 0), dvec3(1, 1, 0), dvec3(-1, 1, 0)}};
  Soup mesh;
  for (const double side : {-1.0, 1.0}) {
    for (int i = 0; i < kTeeth; ++i) {
      const double y[] = {-1 + 2.0 * i / kTeeth, -1 + 2.0 * (i + 1) / kTeeth};
      const double rim[] = {side * (i % 2 ? 0.204 : 0.198), side * (i % 2 ? 0.198 : 0.204)};
      const auto quad = [&](double a0, double a1, double b0, double b1) {
        mesh.push_back({dvec3(a0, y[0], 0), dvec3(a1, y[1], 0), dvec3(b0, y[0], 0)});
        mesh.push_back({dvec3(a1, y[1], 0), dvec3(b1, y[1], 0), dvec3(b0, y[0], 0)});
      };
      quad(side * 0.6, side * 0.6, rim[0], rim[1]);
      quad(side, side, side * 0.6, side * 0.6);
    }
  }
  expect_within(mesh, reference, kTolerance);
  const Soup result = round(mesh, reference, kTolerance, halves(0, 0), {.max_normal_angle = 180});
  expect_within(result, reference, kTolerance);
  EXPECT_LT(result.size(), mesh.size()) << "the far rim is free";
}

// Locked vertices outside the cell are held for another cause, and are outside it all the same.
TEST(DecimationCell, DoesNotBeginAnewWithAPartOfTheReference) {
  const TriangleMesh torus = shapes::torus(across(80), 0.004);
  const ToleranceVolume volume(torus.vertices, torus.triangles, space(), 0.02);
  std::vector<double> lowest;
  for (const dvec3& p : torus.vertices) lowest.push_back(p.x);
  std::ranges::sort(lowest);
  const auto left = [&](double from, bool is_locked) {
    DecimationOptions options;
    options.cell = halves(0, from).back();
    const auto locked = std::make_unique<bool[]>(torus.vertices.size());
    std::ranges::transform(torus.vertices, locked.get(),
                           [&](const dvec3& p) { return !strictly_inside(p, *options.cell); });
    if (is_locked) options.locked = {locked.get(), torus.vertices.size()};
    return decimate(torus.vertices, torus.triangles, space(), &volume, options).triangles.size();
  };
  const double beside_one = (lowest[0] + lowest[1]) / 2;
  EXPECT_GT(left(beside_one, false), left(-kFar, false) + 10) << "a second pass removes some per cent more";
  EXPECT_EQ(left(beside_one, true), left(beside_one, false));
}

/// Two plates of squares meet at x = 0. Each edge of the coarse one has a vertex of the fine one at its middle.
TEST(DecimationCell, HoldsItsTJunctionsAndNoOthers) {
  constexpr int kCount = 8;
  Soup plates;
  for (const int side : {-1, 1}) {
    const double length = side < 0 ? 1.0 / kCount : 2.0 / kCount;
    for (double x = 0; x < 1; x += length) {
      for (double y = -1; y < 1; y += length) {
        const dvec3 a(side * x, y, 0), b(side * (x + length), y, 0), c(side * (x + length), y + length, 0);
        const dvec3 d(side * x, y + length, 0);
        plates.push_back(side > 0 ? std::array{a, b, c} : std::array{a, c, b});
        plates.push_back(side > 0 ? std::array{a, c, d} : std::array{a, d, c});
      }
    }
  }
  const auto left_of = [&](const Box& cell) {
    Soup near = plates;
    std::erase_if(near, [&](const auto& corners) { return !meet(box_of(corners), cell); });
    EXPECT_LT(near.size(), plates.size());
    const TriangleMesh part = mesh_of(near);
    const ToleranceVolume volume(part.vertices, part.triangles, space(), 0.01);
    DecimationOptions options;
    options.cell = cell;
    return decimate(part.vertices, part.triangles, space(), &volume, options);
  };
  const DecimationResult at_the_seam = left_of(halves(1, 0.05).front());
  EXPECT_GE(at_the_seam.locked.at("T-junction"), std::size_t{kCount});
  for (int i = 0; i <= kCount; ++i) {
    const dvec3 on_the_seam(0, double(i) / kCount - 1, 0);
    EXPECT_TRUE(std::ranges::find(at_the_seam.vertices, on_the_seam) != at_the_seam.vertices.end()) << on_the_seam.y;
  }
  const DecimationResult beside_it = left_of(halves(0, 0.3).back());
  EXPECT_FALSE(beside_it.locked.contains("T-junction")) << "the rim of the part is none";
}

TEST(DecimationCell, NeedsBothDirectionsAndAVolume) {
  const TriangleMesh mesh = shapes::sphere(4);
  const ToleranceVolume volume(mesh.vertices, mesh.triangles, space(), 0.01);
  DecimationOptions options;
  options.cell = halves(0, 0).front();
  options.two_sided = false;
  EXPECT_THROW(decimate(mesh.vertices, mesh.triangles, space(), &volume, options), InvalidInput);
  options.two_sided = true, options.target_triangles = 4;
  EXPECT_THROW(decimate(mesh.vertices, mesh.triangles, space(), nullptr, options), InvalidInput);
}

}  // namespace
}  // namespace tolvol

// SPDX-License-Identifier: GPL-3.0-or-later
// Every result with a volume is judged by measure/hausdorff.h on what is stored.
#include "motion/deformation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "base/errors.h"
#include "measure/hausdorff.h"
#include "shapes.h"

namespace {

using namespace tolvol;
using glm::dvec3;
using shapes::indices;
using Options = DeformationOptions;
using Mode = DeformationOptions::Mode;

/// A box somewhat larger than the torus of the shapes.
const glm::dmat4 kAroundTorus(3.2, 0, 0, 0, 0, 3.2, 0, 0, 0, 0, 1.2, 0, -1.6, -1.6, -0.6, 1);

LatticeDeformation shaken(double amount, unsigned seed = 1, const glm::dmat4& domain = kAroundTorus) {
  Lattice lattice;
  lattice.size = {5, 4, 4};
  lattice.domain = domain;
  lattice.points = rest_points(lattice.size, domain);
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> uniform(-amount, amount);
  for (dvec3& p : lattice.points) p += dvec3(uniform(engine), uniform(engine), uniform(engine));
  return LatticeDeformation(lattice);
}

/// Everything is carried along z.
LatticeDeformation lifted(double height, const glm::dmat4& domain = kAroundTorus) {
  Lattice lattice;
  lattice.size = {4, 4, 4};
  lattice.domain = domain;
  lattice.points = rest_points(lattice.size, domain);
  for (dvec3& p : lattice.points) p.z += height;
  return LatticeDeformation(lattice);
}

struct Case {
  TriangleMesh mesh = shapes::torus(48);
  glm::dmat4 to_world = glm::dmat4(1);
  Storage storage = Storage::float32;
  double tolerance = 0.05;

  StoredSpace space() const { return {to_world, storage}; }
  DeformationResult run(const LatticeDeformation& lattice, const Options& options = {}) const {
    const ToleranceVolume volume(mesh.vertices, mesh.triangles, space(), tolerance);
    return deform(mesh.vertices, indices(mesh), 3, space(), &volume, lattice, options);
  }
  TriangleMesh world(std::vector<dvec3> vertices) const {
    for (dvec3& p : vertices) p = space().world(p);
    return {std::move(vertices), mesh.triangles};
  }
  double distance(const DeformationResult& result) const {
    return hausdorff(world(result.vertices), world(mesh.vertices), {tolerance, 1, nullptr}).upper;
  }
};

template <class Body>
void expect_refused(const std::string& part, Body&& body) {
  try {
    body();
    ADD_FAILURE() << "accepted, expected: " << part;
  } catch (const InvalidInput& error) {
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  }
}

TEST(Deformation, WithoutAVolumeVerticesFollowTheLattice) {
  const Case c;
  const LatticeDeformation lattice = shaken(1);
  const DeformationResult r = deform(c.mesh.vertices, {}, 3, c.space(), nullptr, lattice, {});
  double largest = 0;
  for (std::size_t i = 0; i < r.vertices.size(); ++i) {
    const dvec3 motion = *lattice.displacement(c.mesh.vertices[i]);
    EXPECT_EQ(r.vertices[i], rounded_to_float32(c.mesh.vertices[i] + motion));
    largest = std::max(largest, glm::length(r.vertices[i] - c.mesh.vertices[i]));
  }
  EXPECT_EQ(r.moved, r.vertices.size());
  EXPECT_EQ(r.largest_motion, largest);
  EXPECT_EQ(r.permitted_fraction, 1);
  EXPECT_EQ(r.method, "");
}

TEST(Deformation, TheLatticeIsInTheWorldAndTheVerticesAreNot) {
  Case c;
  c.storage = Storage::float64;
  c.to_world = glm::dmat4(0, 2, 0, 0, -3, 0, 0, 0, 0, 0, 5, 0, 7, 8, 9, 1);
  const glm::dmat4 domain = c.to_world * kAroundTorus;
  const DeformationResult r = deform(c.mesh.vertices, {}, 3, c.space(), nullptr, lifted(1, domain), {});
  for (std::size_t i = 0; i < r.vertices.size(); ++i) {
    EXPECT_LT(glm::length(r.vertices[i] - c.mesh.vertices[i] - dvec3(0, 0, 0.2)), 1e-14);
  }
  EXPECT_NEAR(r.largest_motion, 1, 1e-13);
}

TEST(Deformation, OutsideOfTheLatticeVerticesStayBitForBit) {
  Case c;
  c.to_world = glm::dmat4(0.3, 0.1, 0, 0, -0.1, 0.3, 0, 0, 0, 0, 0.7, 0, 0.1, 0.2, 0.3, 1);
  glm::dmat4 half = kAroundTorus;  // x below 0
  half[0] *= 0.5;
  const DeformationResult r = deform(c.mesh.vertices, {}, 3, c.space(), nullptr, lifted(1, c.to_world * half), {});
  std::size_t outside = 0;
  for (std::size_t i = 0; i < r.vertices.size(); ++i) {
    if (c.mesh.vertices[i].x > 1e-4) {
      EXPECT_EQ(r.vertices[i], c.mesh.vertices[i]);
      ++outside;
    } else if (c.mesh.vertices[i].x < 0) {
      EXPECT_NE(r.vertices[i], c.mesh.vertices[i]);
    }
  }
  EXPECT_NEAR(double(r.outside_lattice), double(outside), 8);
  EXPECT_EQ(r.moved + r.outside_lattice, r.vertices.size());
}

TEST(Deformation, InsideItIsCarriedOutWhole) {
  const Case c;
  const LatticeDeformation lattice = shaken(0.05);
  const DeformationResult r = c.run(lattice);
  EXPECT_EQ(r.permitted_fraction, 1);
  EXPECT_EQ(r.vertices, deform(c.mesh.vertices, {}, 3, c.space(), nullptr, lattice, {}).vertices);
  EXPECT_LE(c.distance(r), c.tolerance);
  EXPECT_EQ(r.leaving.faces, 0u);
  EXPECT_EQ(r.method, "certificate");
  EXPECT_EQ(r.renderer, "CPU");
}

TEST(Deformation, BlockedNothingMovesAndTheFractionIsCertified) {
  const Case c;
  const LatticeDeformation lattice = lifted(0.2);
  const DeformationResult blocked = c.run(lattice);
  EXPECT_EQ(blocked.vertices, c.mesh.vertices);
  EXPECT_EQ(blocked.moved, 0u);
  EXPECT_GT(blocked.leaving.faces, 0u);
  ASSERT_TRUE(blocked.leaving.first);
  EXPECT_EQ(blocked.held_back, blocked.vertices.size());
  // The torus is lifted off its rim: the whole way is four tolerances.
  EXPECT_NEAR(*blocked.permitted_fraction, 0.25, 0.002);
  EXPECT_LE(blocked.permitted_fraction, 0.25);

  const DeformationResult farthest = c.run(lattice, {.mode = Mode::farthest});
  EXPECT_EQ(farthest.permitted_fraction, blocked.permitted_fraction);
  EXPECT_NEAR(farthest.largest_motion, 0.2 * *farthest.permitted_fraction, 1e-6);
  const double distance = c.distance(farthest);
  EXPECT_LE(distance, c.tolerance);
  EXPECT_GT(distance, 0.95 * c.tolerance);
}

TEST(Deformation, PulledBackEachVertexGoesAsFarAsItMay) {
  const Case c;
  const LatticeDeformation lattice = lifted(0.2);
  const std::vector<dvec3> wish = deform(c.mesh.vertices, {}, 3, c.space(), nullptr, lattice, {}).vertices;
  const DeformationResult r = c.run(lattice, {.mode = Mode::pull_back});
  const double farthest = c.run(lattice, {.mode = Mode::farthest}).largest_motion;
  EXPECT_LE(c.distance(r), c.tolerance);
  EXPECT_FALSE(r.permitted_fraction);
  std::size_t held = 0, beyond = 0;
  for (std::size_t i = 0; i < wish.size(); ++i) {
    held += r.vertices[i] != wish[i];
    beyond += glm::length(r.vertices[i] - c.mesh.vertices[i]) > 1.2 * farthest;
  }
  EXPECT_EQ(r.held_back, held);
  EXPECT_GT(beyond, wish.size() / 4);  // the flanks of the torus slide along it
}

TEST(Deformation, WhatIsOutsideToBeginWithIsKept) {
  Case c;
  const ToleranceVolume volume(c.mesh.vertices, c.mesh.triangles, c.space(), c.tolerance);
  c.mesh.vertices[100] = rounded_to_float32(1.5 * c.mesh.vertices[100]);
  const std::vector<std::uint32_t> faces = indices(c.mesh);
  for (const double height : {0.02, 0.2}) {
    for (const Mode mode : {Mode::blocked, Mode::farthest, Mode::pull_back}) {
      const Options options{.mode = mode, .outside = Outside::keep};
      const DeformationResult r = deform(c.mesh.vertices, faces, 3, c.space(), &volume, lifted(height), options);
      EXPECT_EQ(r.outside.faces, 6u);
      EXPECT_EQ(r.vertices[100], c.mesh.vertices[100]);
      EXPECT_EQ(r.leaving.faces > 0, height == 0.2);
      EXPECT_EQ(r.moved > 0, height == 0.02 || mode != Mode::blocked);
      EXPECT_GE(r.held_back, 6u);
      TriangleMesh rest = c.world(r.vertices);
      std::erase_if(rest.triangles, [](const glm::uvec3& t) { return t.x == 100 || t.y == 100 || t.z == 100; });
      const TriangleMesh reference = shapes::torus(48);
      EXPECT_LE(hausdorff(rest, reference, {c.tolerance, 1, nullptr}).upper, c.tolerance);
    }
  }
}

TEST(Deformation, HostileStatesAreNeverAcceptedOutside) {
  std::mt19937 engine(3);
  for (unsigned seed = 0; seed < 12; ++seed) {
    Case c;
    c.mesh = shapes::torus(24, 0.01, seed);
    c.tolerance = seed % 2 ? 0.02 : 0.1;
    if (seed % 3 == 0) c.to_world = glm::dmat4(1, 0, 0, 0, 0.9, -0.05, 0, 0, 0, 0.3, 20, 0, 500, 0, 3, 1);
    const LatticeDeformation lattice = shaken(c.tolerance * (1 << seed % 5), seed, c.to_world * kAroundTorus);
    const Mode mode = seed % 4 ? Mode::farthest : Mode::pull_back;
    const DeformationResult r = c.run(lattice, {.mode = mode});
    for (const dvec3& p : r.vertices) EXPECT_EQ(p, rounded_to_float32(p));
    EXPECT_LE(c.distance(r), c.tolerance) << seed;
    EXPECT_GT(r.moved, 0u) << seed;
  }
}

TEST(Deformation, FacesOfFourCornersAreCheckedInEveryTriangulation) {
  // A roof whose ridge is one diagonal of a square; a face along the other diagonal would be a valley.
  const TriangleMesh roof = shapes::squares(1, [](const dvec3& p) { return dvec3(p.x, p.y, 0.3 * (p.x == p.y)); });
  const StoredSpace space(glm::dmat4(1), Storage::float64);
  const ToleranceVolume volume(roof.vertices, roof.triangles, space, 0.1);
  const LatticeDeformation lattice = lifted(0.05, glm::dmat4(glm::dmat3(2)));
  EXPECT_EQ(deform(roof.vertices, indices(roof), 3, space, &volume, lattice, {}).permitted_fraction, 1);
  const std::vector<std::uint32_t> quad = {0, 2, 3, 1};
  expect_refused("1 faces are not within", [&] { deform(roof.vertices, quad, 4, space, &volume, lattice, {}); });
}

TEST(Deformation, ResultDoesNotDependOnThreads) {
  const Case c;
  const LatticeDeformation lattice = shaken(0.4);
  const DeformationResult one = c.run(lattice, {.mode = Mode::farthest, .threads = 1});
  const DeformationResult three = c.run(lattice, {.mode = Mode::farthest, .threads = 3});
  EXPECT_EQ(one.vertices, three.vertices);
  EXPECT_EQ(one.permitted_fraction, three.permitted_fraction);
  EXPECT_LT(one.permitted_fraction, 1);
}

TEST(Deformation, AMeshThatIsOutsideAlreadyIsRefused) {
  const Case c;
  const ToleranceVolume volume(c.mesh.vertices, c.mesh.triangles, c.space(), c.tolerance);
  std::vector<dvec3> vertices = c.mesh.vertices;
  vertices[100] *= 1.5;
  for (const Mode mode : {Mode::blocked, Mode::farthest, Mode::pull_back}) {
    expect_refused("6 faces are not within the tolerance of the reference, the first is face",
                   [&] { deform(vertices, indices(c.mesh), 3, c.space(), &volume, shaken(0.01), {.mode = mode}); });
  }
}

TEST(Deformation, BadArraysAreRefused) {
  const Case c;
  const ToleranceVolume volume(c.mesh.vertices, c.mesh.triangles, c.space(), c.tolerance);
  const LatticeDeformation lattice = shaken(0.01);
  const auto refused = [&](const std::string& part, std::vector<dvec3> vertices, std::vector<std::uint32_t> faces,
                           int corners, const LatticeDeformation& by) {
    expect_refused(part, [&] { deform(vertices, faces, corners, c.space(), &volume, by, {}); });
  };
  std::vector<dvec3> broken = c.mesh.vertices;
  broken[7].z = std::nan("");
  refused("vertex 7 is not finite", broken, indices(c.mesh), 3, lattice);
  std::vector<std::uint32_t> wild = indices(c.mesh);
  wild[3 * 5 + 1] = 99999;
  refused("face 5 uses vertex 99999", c.mesh.vertices, wild, 3, lattice);
  refused("no faces", c.mesh.vertices, {}, 3, lattice);
  refused("1 to 4 corners", c.mesh.vertices, indices(c.mesh), 0, lattice);
  refused("1 to 4 corners", c.mesh.vertices, {0, 1, 2, 3, 4}, 4, lattice);
  refused("carries vertex", c.mesh.vertices, indices(c.mesh), 3, lifted(1e39));
}

TEST(Deformation, RoundingThatIsTooCoarseForTheToleranceIsSaid) {
  Case c;
  c.tolerance = 0.01;
  c.mesh.vertices = shapes::torus(16).vertices, c.mesh.triangles = shapes::torus(16).triangles;
  for (dvec3& p : c.mesh.vertices) p.x += 2000;
  c.mesh = shapes::stored(c.mesh);
  glm::dmat4 domain = kAroundTorus;
  domain[3].x += 2000;
  EXPECT_EQ(c.run(shaken(0.001, 1, domain)).warnings.size(), 1u);
  c.tolerance = 1e-4;
  expect_refused("move the mesh nearer to its origin", [&] { c.run(shaken(1e-6, 1, domain)); });
}

TEST(Deformation, CanBeCancelled) {
  const Case c;
  Progress progress;
  progress.cancel();
  EXPECT_THROW(c.run(shaken(0.1), {.progress = &progress}), Cancelled);
}

}  // namespace

// SPDX-License-Identifier: GPL-3.0-or-later
/// Meshes for the tests, all made here.
#pragma once

#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <random>
#include <vector>

#include "geometry/frame.h"
#include "geometry/triangle_mesh.h"

namespace tolvol::shapes {

using glm::dvec3;

/// Numbers that follow from the seed alone.
struct Random {
  explicit Random(unsigned seed) : engine(seed) {}
  dvec3 point() { return {normal(engine), normal(engine), normal(engine)}; }  ///< normally distributed around 0
  double share() { return uniform(engine); }                                  ///< in [0, 1)
  unsigned below(unsigned n) { return std::uniform_int_distribution<unsigned>(0, n - 1)(engine); }

  std::mt19937 engine;
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
};

/// Three indices for each triangle, as operations on faces take them.
inline std::vector<std::uint32_t> indices(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> result;
  for (const glm::uvec3& t : mesh.triangles) result.insert(result.end(), {t.x, t.y, t.z});
  return result;
}

/// The coordinates as a guard takes them.
inline std::vector<float> flat(const std::vector<dvec3>& points) {
  std::vector<float> result;
  for (const dvec3& p : points) result.insert(result.end(), {float(p.x), float(p.y), float(p.z)});
  return result;
}

/// Rounded to float32, as Blender would store it.
inline TriangleMesh stored(TriangleMesh mesh) {
  for (dvec3& p : mesh.vertices) p = rounded_to_float32(p);
  return mesh;
}

/// n x n squares over [0, 1]^2, each two triangles, with `place` applied to every vertex; vertex (i, j) is i (n + 1) +
/// j.
template <class Place>
TriangleMesh squares(unsigned n, Place&& place) {
  TriangleMesh mesh;
  for (unsigned i = 0; i <= n; ++i) {
    for (unsigned j = 0; j <= n; ++j) mesh.vertices.push_back(place(dvec3(i, j, 0) / double(n)));
  }
  for (unsigned i = 0; i < n; ++i) {
    for (unsigned j = 0; j < n; ++j) {
      const unsigned a = i * (n + 1) + j, b = a + n + 1;
      mesh.triangles.emplace_back(a, b, b + 1);
      mesh.triangles.emplace_back(a, b + 1, a + 1);
    }
  }
  return mesh;
}

/// The same in the plane z = 0.
inline TriangleMesh grid(unsigned n) {
  return squares(n, [](const dvec3& p) { return p; });
}

/// A closed torus of n x n squares; radii 1 and 0.4, optional noise along the normal.
inline TriangleMesh torus(unsigned n, double noise = 0, unsigned seed = 1) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal(0, 1);
  TriangleMesh mesh;
  for (unsigned i = 0; i < n; ++i) {
    for (unsigned j = 0; j < n; ++j) {
      const double u = 2 * std::numbers::pi * i / n, v = 2 * std::numbers::pi * j / n, r = 0.4 + noise * normal(engine);
      mesh.vertices.emplace_back((1 + r * std::cos(v)) * std::cos(u), (1 + r * std::cos(v)) * std::sin(u),
                                 r * std::sin(v));
    }
  }
  const auto at = [n](unsigned i, unsigned j) { return (i % n) * n + j % n; };
  for (unsigned i = 0; i < n; ++i) {
    for (unsigned j = 0; j < n; ++j) {
      mesh.triangles.emplace_back(at(i, j), at(i + 1, j), at(i + 1, j + 1));
      mesh.triangles.emplace_back(at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
  return stored(mesh);
}

/// A fan of n triangles around vertex 0, which is as high as `height`; its rim is a circle in the plane z = 0.
inline TriangleMesh fan(unsigned n, double height = 0) {
  TriangleMesh mesh{{{0, 0, height}}, {}};
  for (unsigned i = 0; i < n; ++i) {
    const double angle = 2 * std::numbers::pi * i / n;
    mesh.vertices.emplace_back(std::cos(angle), std::sin(angle), 0);
    mesh.triangles.emplace_back(0, i + 1, (i + 1) % n + 1);
  }
  return mesh;
}

/// The closed surface of a box with n x n squares a side.
inline TriangleMesh box(unsigned n) {
  TriangleMesh mesh;
  std::map<std::array<int, 3>, unsigned> index;
  const auto vertex = [&](std::array<int, 3> p) {
    const auto [at, added] = index.try_emplace(p, unsigned(mesh.vertices.size()));
    if (added) mesh.vertices.emplace_back(double(p[0]) / n, double(p[1]) / n, double(p[2]) / n);
    return at->second;
  };
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 2; ++side) {
      for (int i = 0; i < int(n); ++i) {
        for (int j = 0; j < int(n); ++j) {
          const auto corner = [&](int di, int dj) {
            std::array<int, 3> p{};
            p[axis] = side * int(n), p[(axis + 1) % 3] = i + di, p[(axis + 2) % 3] = j + dj;
            return vertex(p);
          };
          const unsigned a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
          if (side) {
            mesh.triangles.emplace_back(a, b, c), mesh.triangles.emplace_back(a, c, d);
          } else {
            mesh.triangles.emplace_back(a, c, b), mesh.triangles.emplace_back(a, d, c);
          }
        }
      }
    }
  }
  return stored(mesh);
}

/// A closed sphere about the origin, of as many squares.
inline TriangleMesh sphere(unsigned n, double radius = 1) {
  TriangleMesh mesh = box(n);
  for (glm::dvec3& p : mesh.vertices) p = radius * glm::normalize(p - 0.5);
  return mesh;
}

/// Returns the mesh with each triangle turned over.
inline TriangleMesh turned(TriangleMesh mesh) {
  for (glm::uvec3& t : mesh.triangles) std::swap(t.y, t.z);
  return mesh;
}

/// Every triangle with vertices of its own.
inline TriangleMesh soup(const TriangleMesh& mesh) {
  TriangleMesh result;
  for (const glm::uvec3& t : mesh.triangles) {
    const unsigned first = unsigned(result.vertices.size());
    for (int k = 0; k < 3; ++k) result.vertices.push_back(mesh.vertices[t[k]]);
    result.triangles.emplace_back(first, first + 1, first + 2);
  }
  return result;
}

inline TriangleMesh joined(TriangleMesh a, const TriangleMesh& b) {
  const unsigned offset = unsigned(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const glm::uvec3& t : b.triangles) a.triangles.push_back(t + offset);
  return a;
}

}  // namespace tolvol::shapes

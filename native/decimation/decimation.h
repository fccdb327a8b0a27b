// SPDX-License-Identifier: GPL-3.0-or-later
/// Mesh decimation within a tolerance, certified in both directions.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "check/tolerance_volume.h"
#include "decimation/ring_check.h"

namespace tolvol {

struct DecimationOptions {
  enum class Placement { optimal, subset };
  enum class Outside { error, keep };
  enum class Effort { fast, thorough };

  /// optimal: fewest triangles; subset: every surviving vertex is an original one.
  Placement placement = Placement::optimal;
  bool two_sided = true;             ///< also keep the whole reference within the tolerance of the result
  Effort effort = Effort::fast;      ///< thorough: then moves vertices and flips edges to collapse more
  double max_seconds = 0;            ///< it stops there with what is proved by then; 0: no limit
  std::size_t target_triangles = 0;  ///< stop at this many; 0: as few as the tolerance allows
  /// Per input vertex, may be empty: neither moves nor vanishes, and an edge between two such stays.
  std::span<const bool> locked = {};
  /// Per input vertex, 0 to 1, may be empty: how much of the tolerance the new faces around it may use.
  std::span<const double> shares = {};
  Outside outside = Outside::error;            ///< what to do with input faces that are not within the tolerance
  std::span<const std::uint32_t> wedges = {};  ///< per input corner, may be empty: see wedge_labels()
  RingCheck* baseline = nullptr;  ///< for comparisons: decides in place of all that is certified; nothing is promised
  unsigned threads = 0;           ///< 0: one per core; never changes the result
  Progress* progress = nullptr;
};

struct Repair {
  std::string kind;
  std::size_t count;
  std::string message;
};

struct DecimationResult {
  std::vector<glm::dvec3> vertices;  ///< stored coordinates
  std::vector<glm::uvec3> triangles;
  std::vector<std::int32_t> vertex_map;      ///< per input vertex: the result vertex it became; -1: no triangle uses it
  std::vector<std::uint32_t> vertex_source;  ///< per result vertex: the input vertex it continues
  std::vector<std::uint32_t> triangle_source;  ///< per result triangle: the input triangle it continues
  std::vector<glm::uvec3> source_triangle;     ///< per result corner: the input triangle whose attributes it takes, ...
  std::vector<glm::dmat3> source_weights;      ///< ... and the barycentric weights there, a column a corner
  bool stopped_at_target = false;
  bool stopped_at_time = false;
  bool stopped_on_request = false;  ///< of Progress::finish()
  std::string method, renderer;     ///< of the check that bounded it; empty without a volume
  std::vector<Repair> repairs;
  std::map<std::string, std::size_t> locked;  ///< vertices that could not move, by cause
  std::size_t outside_faces = 0;              ///< input faces not within the tolerance, kept as they are
  std::optional<std::uint32_t> first_outside;
  std::size_t uncovered_faces = 0;  ///< reference faces of which a part was not within the tolerance of the input
  std::vector<std::string> warnings;
};

/// `volume` null: no tolerance at all, a target is needed (the loop that the bounded one is compared with).
/// Throws InvalidInput for a bad mesh, for input that is outside its reference (unless Outside::keep), and where the
/// stored type cannot hold the tolerance; Cancelled. About 3 us a triangle.
DecimationResult decimate(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles,
                          const StoredSpace& space, const ToleranceVolume* volume, const DecimationOptions& options);

}  // namespace tolvol

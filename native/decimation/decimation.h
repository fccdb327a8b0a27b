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

#include "check/facing.h"
#include "check/outside.h"
#include "check/ring_check.h"
#include "check/tolerance_volume.h"

namespace tolvol {

struct DecimationOptions {
  enum class Placement { optimal, subset };
  enum class Effort { fast, thorough };
  enum class Crossings { keep_out, allow };

  /// optimal leaves the fewest triangles; subset leaves vertices only where original ones were.
  Placement placement = Placement::optimal;
  bool two_sided = true;         ///< Also keeps the whole reference within the tolerance of the result.
  Effort effort = Effort::fast;  ///< See decimate() for what each costs.
  /// keep_out: two faces of the result may cross only where input faces that they stand for crossed
  /// (topology/new_crossings.h). Ignored without a volume and where a baseline decides.
  Crossings crossings = Crossings::keep_out;
  /// In degrees, more than 0 and at most 180: every point of a face has a witness within the tolerance whose normal is
  /// within this angle of the face's (check/facing.h). 180 keeps no angle. Ignored without
  /// a volume and where a baseline decides.
  double max_normal_angle = 90;
  double max_seconds = 0;            ///< Decimation stops after this time with what is proved; 0 means no limit.
  std::size_t target_triangles = 0;  ///< Decimation stops at this number; 0 means as few as the tolerance allows.
  /// For each input vertex, or empty: it neither moves nor vanishes, and an edge between two such vertices stays.
  std::span<const bool> locked = {};
  /// For each input vertex, or empty: the share of the tolerance, 0 to 1, that the new faces around it may use.
  /// A face that does not change when a vertex of a smaller share becomes one with its corner may keep what it uses.
  std::span<const double> shares = {};
  Outside outside = Outside::error;            ///< What happens to input faces that are not within the tolerance.
  std::span<const std::uint32_t> wedges = {};  ///< For each input corner, or empty: see wedge_labels().
  /// Only faces whose corners are strictly inside this box of stored positions change, and their corners stay strictly
  /// inside. All others stand still and are not certified. Faces of the reference that the input does not cover are no
  /// error. If a piece of such a face may be covered in part, the input faces within the tolerance of this piece stand
  /// still. So boxes without a common inner point, each with all faces that meet it and all of the reference within the
  /// tolerance of it, may be decimated at once (docs/architecture.md). Needs two_sided.
  std::optional<Box> cell = {};
  RingCheck* baseline =
      nullptr;           ///< For comparisons: it decides in place of the certificates, and nothing is promised.
  unsigned threads = 0;  ///< 0 is one for each core. It never changes the result.
  Progress* progress = nullptr;
};

struct Repair {
  std::string kind;
  std::size_t count;
  std::string message;
};

struct DecimationResult {
  std::vector<glm::dvec3> vertices;  ///< In stored coordinates.
  std::vector<glm::uvec3> triangles;
  std::vector<std::int32_t>
      vertex_map;  ///< For each input vertex: the result vertex that it became; -1 if no triangle uses it.
  std::vector<std::uint32_t> vertex_source;    ///< For each result vertex: the input vertex that it continues.
  std::vector<std::uint32_t> triangle_source;  ///< For each result triangle: the input triangle that it continues.
  std::vector<glm::uvec3> source_triangle;  ///< For each result corner: the input triangle whose attributes it takes.
  /// For each result corner: its barycentric weights in source_triangle. A matrix has a column for each corner.
  std::vector<glm::dmat3> source_weights;
  bool stopped_at_target = false;
  bool stopped_at_time = false;
  bool stopped_on_request = false;  ///< By Progress::finish().
  std::string method, renderer;     ///< The check that decided; empty without a volume.
  std::vector<Repair> repairs;
  std::map<std::string, std::size_t> locked;  ///< The number of vertices that could not move, by cause.
  std::optional<Normals> normals;             ///< How the faces face the reference; none where no angle was kept.
  FaceCount outside;    ///< Input faces that are not within the tolerance and are kept as they are.
  FaceCount uncovered;  ///< Faces of the reference that are not within the tolerance of the input.
  std::vector<std::string> warnings;
};

/// Without a volume there is no tolerance at all, and a target is needed: this is the loop that the bounded one is
/// compared with. Throws InvalidInput for a bad mesh, for input that is outside its reference (unless Outside::keep),
/// and where the stored type cannot hold the tolerance; Cancelled. On one thread Effort::fast takes 7 to 9 us a
/// triangle at a tolerance of 1 % and 30 to 53 us at 0.1 %, with the grid of the volume and crossings kept out.
/// Effort::thorough then collapses more edges, and moves the vertices around each together: a third fewer triangles in
/// 5 to 25 times the processor time. A mesh of some hundred triangles may take 75 times as long, and 20 seconds.
DecimationResult decimate(std::span<const glm::dvec3> vertices, std::span<const glm::uvec3> triangles,
                          const StoredSpace& space, const ToleranceVolume* volume, const DecimationOptions& options);

}  // namespace tolvol

// SPDX-License-Identifier: GPL-3.0-or-later
#include "check/tolerance_check.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "base/call.h"
#include "base/errors.h"

namespace tolvol {

namespace {

/// Of the frame: the reference is within 1 of its centre and no tolerance is larger than 2, so that a point twice as
/// far from either is refuted.
constexpr double kFar = 8;

bool finite(const glm::dvec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

}  // namespace

std::span<const PieceTriangle> triangles_of(int corners) {
  static constexpr PieceTriangle kPoint[] = {{0, 0, 0}}, kSegment[] = {{0, 1, 1}}, kTriangle[] = {{0, 1, 2}},
                                 kQuad[] = {{0, 1, 2}, {0, 2, 3}, {0, 1, 3}, {1, 2, 3}};
  static constexpr std::span<const PieceTriangle> kTriangles[] = {kPoint, kSegment, kTriangle, kQuad};
  return kTriangles[corners - 1];
}

PlacedPoints::PlacedPoints(std::span<const glm::dvec3> stored, const StoredSpace& space,
                           const ToleranceVolume& volume) {
  const Frame& frame = volume.frame();
  const StoredSpace world = space.in(Frame()), placed = space.in(frame);
  const glm::dvec3 centre = frame.to_world(glm::dvec3(0));
  points.reserve(stored.size());
  std::vector<glm::dvec3> near;
  near.reserve(stored.size());
  for (const glm::dvec3& p : stored) {
    const glm::dvec3 at = placed.frame(p);
    if (glm::all(glm::lessThanEqual(glm::abs(at), glm::dvec3(kFar)))) {
      near.push_back(p), points.push_back(at);
      continue;
    }
    const std::string name = "point " + std::to_string(points.size());
    if (!finite(p)) throw InvalidInput(name + " is not finite", "invalid_mesh");
    // In the world: a point may leave the range of double by the frame's scale alone.
    const glm::dvec3 away = glm::abs(world.world(p) - centre);
    const double certain = kFar / frame.scale() + world.mapping_error(std::span(&p, 1));
    if (!(std::max({away.x, away.y, away.z}) > certain)) {
      throw InvalidInput(name + " is too far away for double precision under to_world; move it nearer to the origin",
                         "too_far");
    }
    points.push_back(glm::clamp(at, -kFar, kFar));
  }
  mapping_error = placed.mapping_error(near);
}

void require_valid(const Pieces& pieces) {
  if (pieces.corners < 1 || pieces.corners > 4) {
    throw InvalidInput("a face must have 1 to 4 corners; triangulate larger ones");
  }
  const std::size_t corners = static_cast<std::size_t>(pieces.corners);
  if (pieces.indices.size() % corners != 0) throw InvalidInput("the face array is not a whole number of faces");
  for (std::size_t i = 0; i < pieces.indices.size(); ++i) {
    poll_at(i);
    if (pieces.indices[i] < pieces.points.size()) continue;
    throw InvalidInput("faces[" + std::to_string(i / corners) + "] uses point " + std::to_string(pieces.indices[i]) +
                           ", but there are only " + std::to_string(pieces.points.size()),
                       "invalid_mesh");
  }
}

std::vector<Verdict> ToleranceCheck::check_groups(const Pieces& pieces, std::span<const std::int32_t> groups,
                                                  const Options& options) const {
  const Call call(options.progress);
  std::vector<Verdict> verdicts = check(pieces, options);
  combine_groups(verdicts, groups);
  return verdicts;
}

void combine_groups(std::span<Verdict> verdicts, std::span<const std::int32_t> groups) {
  if (groups.size() != verdicts.size()) throw InvalidInput("groups must have one label for each face");
  std::unordered_map<std::int32_t, Verdict> least;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    poll_at(i);
    const auto [entry, added] = least.try_emplace(groups[i], verdicts[i]);
    if (!added) entry->second = std::min(entry->second, verdicts[i]);
  }
  for (std::size_t i = 0; i < groups.size(); ++i) {
    poll_at(i);
    verdicts[i] = least.at(groups[i]);
  }
}

}  // namespace tolvol

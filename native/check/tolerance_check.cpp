// SPDX-License-Identifier: GPL-3.0-or-later
#include "check/tolerance_check.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "base/call.h"
#include "base/errors.h"

namespace tolvol {

namespace {

/// A coordinate in the frame. The reference is within 1 of its centre and no tolerance is larger than 2, so that a
/// point this far away is outside.
constexpr double kFar = 8;

bool finite(const glm::dvec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

void require_labels(std::size_t labels, std::size_t pieces) {
  if (labels != pieces) throw InvalidInput("groups must have one label for each face");
}

}  // namespace

std::span<const PieceTriangle> triangles_of(int corners) {
  static constexpr PieceTriangle kPoint[] = {{0, 0, 0}}, kSegment[] = {{0, 1, 1}}, kTriangle[] = {{0, 1, 2}},
                                 kQuad[] = {{0, 1, 2}, {0, 2, 3}, {0, 1, 3}, {1, 2, 3}};
  static constexpr std::span<const PieceTriangle> kTriangles[] = {kPoint, kSegment, kTriangle, kQuad};
  return kTriangles[corners - 1];
}

PlacedPieces::PlacedPieces(const Pieces& pieces, const ToleranceVolume& volume)
    : points(pieces.points.size(), glm::dvec3(0)),
      used(pieces.points.size(), false),
      indices(pieces.indices),
      corners(pieces.corners) {
  if (corners < 1 || corners > 4) throw InvalidInput("a face must have 1 to 4 corners; triangulate larger ones");
  if (indices.size() % static_cast<std::size_t>(corners) != 0) {
    throw InvalidInput("the face array is not a whole number of faces");
  }
  for (std::size_t i = 0; i < indices.size(); ++i) {
    poll_at(i);
    if (indices[i] >= points.size()) {
      throw InvalidInput("faces[" + std::to_string(i / static_cast<std::size_t>(corners)) + "] uses point " +
                             std::to_string(indices[i]) + ", but there are only " + std::to_string(points.size()),
                         "invalid_mesh");
    }
    used[indices[i]] = true;
  }
  const Frame& frame = volume.frame();
  const StoredSpace world = pieces.space.in(Frame()), placed = pieces.space.in(frame);
  Box counted;  // the box of the points whose mapping error counts
  for (std::size_t i = 0; i < points.size(); ++i) {
    poll_at(i);
    const glm::dvec3& p = pieces.points[i];
    if (!finite(p)) throw InvalidInput("point " + std::to_string(i) + " is not finite", "invalid_mesh");
    if (!used[i]) continue;
    const glm::dvec3 at = placed.frame(p);
    if (glm::all(glm::lessThanEqual(glm::abs(at), glm::dvec3(kFar)))) {
      points[i] = at;
      counted.add(p);
      continue;
    }
    // This compares in the world because the frame's scale alone may take a point out of the range of double.
    const glm::dvec3 away = glm::abs(world.frame(p) - frame.centre());
    const double certain = kFar / frame.scale() + world.mapping_error({&p, 1});
    if (!(std::max({away.x, away.y, away.z}) > certain)) {
      throw InvalidInput("point " + std::to_string(i) +
                             " is too far away for double precision under to_world; move it nearer to the origin",
                         "too_far");
    }
    points[i] = glm::clamp(at, -kFar, kFar);
  }
  const glm::dvec3 ends[2] = {counted.lower, counted.upper};
  mapping_error = counted.empty() ? 0 : placed.mapping_error(ends);
}

std::vector<Verdict> ToleranceCheck::check(const Pieces& pieces, const Options& options) const {
  const Call call(options.progress);
  if (options.progress) options.progress->begin("checking");
  return verdicts(PlacedPieces(pieces, *volume_), options);
}

std::vector<Verdict> ToleranceCheck::check_groups(const Pieces& pieces, std::span<const std::int32_t> groups,
                                                  const Options& options) const {
  const Call call(options.progress);
  if (options.progress) options.progress->begin("checking");
  const PlacedPieces placed(pieces, *volume_);
  require_labels(groups.size(), placed.size());
  return group_verdicts(placed, groups, options);
}

std::vector<Verdict> ToleranceCheck::group_verdicts(const PlacedPieces& pieces, std::span<const std::int32_t> groups,
                                                    const Options& options) const {
  std::vector<Verdict> result = verdicts(pieces, options);
  combine_groups(result, groups);
  return result;
}

void combine_groups(std::span<Verdict> verdicts, std::span<const std::int32_t> groups) {
  require_labels(groups.size(), verdicts.size());
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

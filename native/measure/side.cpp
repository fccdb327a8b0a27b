// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/side.h"

#include <algorithm>
#include <cmath>

#include "base/call.h"

namespace tolvol {
namespace {

using glm::dvec3;

// What is no larger than this, in the frame, is within rounding of a point.
constexpr double kPoint = 4 * kUnitRoundoff;
// Products of three numbers up to 2 to this power do not overflow.
constexpr double kLargestExponent = 320;

/// Returns the world mesh about the centre of the frame, as small as it takes for its volume, a sum of products of
/// three coordinates, not to overflow.
TriangleMesh for_volume(TriangleMesh mesh, const Frame& frame) {
  double largest = 0;
  std::size_t turn = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    poll_at(++turn);
    for (int k = 0; k < 3; ++k) {
      const dvec3 p = glm::abs(mesh.vertices[t[k]]);
      largest = std::max({largest, p.x, p.y, p.z});
    }
  }
  const double scale = std::min(frame.scale(), std::exp2(std::floor(kLargestExponent - std::log2(largest))));
  for (dvec3& p : mesh.vertices) p = p * scale - frame.centre() * scale;
  return mesh;
}

}  // namespace

bool is_a_point(const TriangleMesh& mesh) {
  const Box box = box_of(mesh);
  return glm::distance(box.lower, box.upper) <= kPoint;
}

SideOf::SideOf(const PlacedPair& pair, const TriangleMesh& world_b) : normals_(pair.b), point_(is_a_point(pair.b)) {
  known_ = pair.whole && !point_ ? normals_.closed() : is_closed(world_b);
  turn_ = enclosed_volume(pair.whole ? pair.b : for_volume(world_b, pair.frame)) < 0 ? -1 : 1;
}

}  // namespace tolvol

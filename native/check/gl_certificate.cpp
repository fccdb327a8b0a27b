// SPDX-License-Identifier: GPL-3.0-or-later
// This leaves out the parts of certificate.cpp that a GPU is bad at: it has no hierarchy, hence no proof of "outside",
// and it walks the parts depth first by counting, without a stack. Candidates that the nearest triangle does not settle
// are collected and looked at again, so that the many quick candidates never wait for the few slow ones beside them.
#include "check/gl_certificate.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numeric>
#include <span>

#include "base/call.h"
#include "base/parallel.h"
#include "gl/context.h"

namespace tolvol {
namespace {

// The GPU holds this many triangles at a time, in 6 MB.
constexpr std::size_t kBatch = 1 << 17;
// The first step of candidates that may each take the whole budget has this many triangles.
constexpr std::size_t kSlowBatch = 1 << 6;
// After a step that took fewer seconds than this the next step is larger.
constexpr double kQuick = 0.04;
// A triangle is left unproved after this many parts.
constexpr int kBudget = 1 << 12;
// A part is tried against the triangles of this many nodes around its centre.
constexpr int kTries = 8;
// A part this short, in tolerances, is not split further.
constexpr double kShortest = 1.0 / 16;
// This is local_size_x of certificate.comp.
constexpr GLuint kGroup = 64;
// A point with this coordinate, in the frame, is farther than any tolerance from any reference.
constexpr float kTooFar = 16;

/// Returns a threshold: if a squared distance in floating point is not larger, the distance is at most `limit`. The two
/// sums, the squares and the rounding of the threshold each change it by a factor of at most 1 + 2^-23, and there is
/// room for twice as many factors.
float threshold(double limit) { return static_cast<float>(limit * limit * (1 - 0x1p-20)); }

struct CertificateProgram : gl::Program {
  CertificateProgram() : Program({{GL_COMPUTE_SHADER, {"witness.glsl", "split.glsl", "certificate.comp"}}}) {}
};

/// Returns nine coordinates for each triangle of `count` pieces from `begin` on.
std::vector<float> corners_to_send(const PlacedPieces& pieces, std::size_t begin, std::size_t count, double magnitude,
                                   unsigned threads) {
  const std::span<const PieceTriangle> triangles = triangles_of(pieces.corners);
  std::vector<float> result(9 * count * triangles.size());
  constexpr std::size_t kBlock = 4096;
  parallel_for(count, kBlock, threads, [&](std::size_t first, std::size_t last) {
    float* to = result.data() + 9 * first * triangles.size();
    for (std::size_t i = begin + first; i < begin + last; ++i) {
      for (const PieceTriangle& triangle : triangles) {
        for (const std::uint8_t corner : triangle) {
          const glm::dvec3& p = pieces.points[pieces.indices[i * static_cast<std::size_t>(pieces.corners) + corner]];
          for (int k = 0; k < 3; ++k) {
            // Larger numbers would cost precision, and GLSL promises nothing for NaN.
            *to++ = std::abs(p[k]) <= magnitude ? static_cast<float>(p[k]) : kTooFar;
          }
        }
      }
    }
  });
  return result;
}

}  // namespace

GlCertificate::GlCertificate(const ToleranceVolume& volume) : ToleranceCheck(volume), renderer_(gl::renderer().name()) {
  const std::vector<std::uint32_t>& nodes = volume.grid().triangle;
  const TriangleMesh& reference = volume.reference();
  // Of corner 0 of each triangle, or of the edge from there to another corner.
  const auto coordinates = [&](int corner) {
    std::vector<float> values;
    values.reserve(3 * reference.triangles.size());
    for (const glm::uvec3& t : reference.triangles) {
      poll_at(values.size());
      const glm::dvec3 &a = reference.vertices[t.x], &end = reference.vertices[t[corner]];
      const glm::dvec3 value = corner == 0 ? a : end - a;
      for (int k = 0; k < 3; ++k) values.push_back(static_cast<float>(value[k]));
    }
    return values;
  };
  gl::run([&] {
    const auto require_room = [](std::size_t bytes, const char* what) {
      gl::Buffer::require_room(bytes, what, "the method certificate");
    };
    require_room(nodes.size() * sizeof(std::uint32_t), "the ids at the grid's nodes");
    require_room(3 * reference.triangles.size() * sizeof(float), "the corners of the reference's triangles");
    nodes_ = gl::Buffer(nodes);
    a_ = gl::Buffer(coordinates(0));
    ab_ = gl::Buffer(coordinates(1));
    ac_ = gl::Buffer(coordinates(2));
    gl::of_context<CertificateProgram>();
  });
}

std::vector<Verdict> GlCertificate::verdicts(const PlacedPieces& pieces, const Options& options) const {
  std::vector<Verdict> verdicts(pieces.size(), Verdict::unproved);
  const double tolerance = volume().frame_tolerance(), magnitude = 1 + 2 * tolerance;
  const double limit = volume().provable(pieces.mapping_error) - float_error(magnitude);
  if (!(limit > 0.5 * tolerance) || pieces.size() == 0) return verdicts;

  const std::size_t per_piece = triangles_of(pieces.corners).size(), per_batch = kBatch / per_piece,
                    most = std::min(pieces.size(), per_batch) * per_piece;
  gl::Buffer corners, open_candidates, results;
  gl::run([&] {
    corners = gl::Buffer(9 * most * sizeof(float), nullptr);
    open_candidates = gl::Buffer(most * sizeof(std::uint32_t), nullptr);
    results = gl::Buffer(most * sizeof(std::uint32_t), nullptr);
  });
  std::vector<std::uint32_t> open, proved;
  const auto look_at = [&](std::span<const std::uint32_t> candidates, int tries, int budget) {
    // This sets all state anew, because other code may have used the context since the last call.
    const gl::Program& program = gl::of_context<CertificateProgram>();
    const DistanceGrid& grid = volume().grid();
    program.use();
    program.set("open_count", static_cast<unsigned>(candidates.size()));
    program.set("origin", glm::vec3(grid.origin));
    program.set("spacing", static_cast<float>(grid.spacing));
    program.set("nodes", grid.nodes);
    program.set("pitch", grid.pitch);
    program.set("limit2", threshold(limit));
    program.set("shortest", static_cast<float>(kShortest * limit));
    program.set("tries", tries);
    program.set("budget", budget);
    const gl::Buffer* const bindings[] = {&corners, &open_candidates, &results, &nodes_, &a_, &ab_, &ac_};
    for (GLuint i = 0; i < std::size(bindings); ++i) bindings[i]->bind_storage(i);
    open_candidates.write(0, candidates.size_bytes(), candidates.data());
    glDispatchCompute((static_cast<GLuint>(candidates.size()) + kGroup - 1) / kGroup, 1, 1);
    results.read(0, proved.size() * sizeof(std::uint32_t), proved.data());
  };

  for (std::size_t begin = 0; begin < pieces.size(); begin += per_batch) {
    const auto update = [&] {
      poll();
      if (options.progress) options.progress->update(static_cast<double>(begin) / static_cast<double>(pieces.size()));
    };
    update();
    const std::size_t count = std::min(per_batch, pieces.size() - begin);
    const std::vector<float> sent = corners_to_send(pieces, begin, count, magnitude, options.threads);
    open.resize(count * per_piece), proved.resize(count * per_piece);
    std::iota(open.begin(), open.end(), 0u);
    gl::run([&] {
      corners.write(0, sent.size() * sizeof(float), sent.data());
      results.clear();
      look_at(open, 1, 1);
    });
    std::erase_if(open, [&](std::uint32_t i) { return proved[i] == 1; });
    // This goes in steps, because only between them a cancel is seen and a GPU serves its screen.
    std::size_t step = kSlowBatch;
    for (std::span<const std::uint32_t> rest = open; !rest.empty();) {
      update();
      const std::span<const std::uint32_t> next = rest.first(std::min(step, rest.size()));
      const auto start = std::chrono::steady_clock::now();
      gl::run([&] { look_at(next, kTries, kBudget); });
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
      step = took.count() < kQuick ? 2 * step : kSlowBatch;
      rest = rest.subspan(next.size());
    }
    for (std::size_t i = 0; i < count; ++i) {
      const std::span<const std::uint32_t> own = std::span(proved).subspan(i * per_piece, per_piece);
      if (std::ranges::all_of(own, [](std::uint32_t p) { return p == 1; })) verdicts[begin + i] = Verdict::inside;
    }
  }
  poll();
  return verdicts;
}

}  // namespace tolvol

// SPDX-License-Identifier: GPL-3.0-or-later
// Differs from certificate.cpp in what a GPU is bad at: no hierarchy, hence no proof of "outside"; parts are walked
// depth first by counting, without a stack. Candidates that the nearest triangle does not settle are collected and
// looked at again, so that the many quick ones never wait for the few slow ones beside them.
#include "check/gl_certificate.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>
#include <sstream>

#include "gl/context.h"
#include "reference/errors.h"
#include "reference/parallel.h"

namespace tolvol {
namespace {

constexpr std::size_t kBatch = 1 << 18;    // candidates on the GPU at a time: 12 MB
constexpr std::size_t kSlowBatch = 1 << 14;  // of those that may take a whole budget each: seconds, before a cancel is seen
constexpr int kBudget = 1 << 12;           // parts looked at before a candidate is left unproved
constexpr double kShortest = 1.0 / 16;     // of the tolerance: a part this short is not split further
constexpr GLuint kGroupSize = 64;          // as in certificate.comp
constexpr float kFar = 16;                 // a coordinate that is near no reference: the frame's are below 1 + 2 * 2

/// The largest float whose square root, rounding of the three squares' sum and of this number itself included, is at
/// most `within`: four roundings of at most 2^-23, and room.
float threshold(double within) { return static_cast<float>(within * within * (1 - 0x1p-20)); }

/// Throws ResourceLimit unless GL takes a buffer of that many bytes. On the GL thread.
void require_room(std::size_t bytes, const std::string& what) {
  GLint64 limit = 0;
  glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &limit);
  if (static_cast<GLint64>(bytes) <= limit) return;
  std::ostringstream text;
  text << what << " take " << (bytes >> 20) << " MB, more than this GL holds in one buffer (" << (limit >> 20)
       << " MB); the method \"certificate\" has no such limit";
  throw ResourceLimit(text.str());
}

struct Triangle {
  std::uint32_t a, b, c;
};

/// The triangles of a piece, as corners of the piece.
std::span<const Triangle> triangles_of(int corners) {
  static constexpr Triangle kPoint[] = {{0, 0, 0}}, kSegment[] = {{0, 1, 1}}, kTriangle[] = {{0, 1, 2}},
                            kQuad[] = {{0, 1, 2}, {0, 2, 3}, {0, 1, 3}, {1, 2, 3}};
  switch (corners) {
    case 1:
      return kPoint;
    case 2:
      return kSegment;
    case 3:
      return kTriangle;
    case 4:
      return kQuad;
    default:
      throw InvalidInput("a face must have 1 to 4 corners; triangulate larger ones");
  }
}

}  // namespace

/// The candidates that are on the GPU; kept from one batch to the next. Made, used and destroyed like its buffers.
class GlCertificate::Batch {
 public:
  explicit Batch(std::size_t most)
      : corners_(9 * most * sizeof(float), nullptr),
        open_(most * sizeof(std::uint32_t), nullptr),
        proved_(most * sizeof(std::uint32_t), nullptr) {}

  void send(const std::vector<float>& corners) {
    corners_.write(0, corners.size() * sizeof(float), corners.data());
    proved_.clear();
  }

  /// Looks at the candidates of `open`; program and reference are set up.
  void look_at(const gl::Program& program, std::span<const std::uint32_t> open, int tries, int budget) {
    open_.write(0, open.size_bytes(), open.data());
    corners_.bind_storage(0), open_.bind_storage(1), proved_.bind_storage(2);
    program.set("open_count", static_cast<unsigned>(open.size()));
    program.set("tries", tries);
    program.set("budget", budget);
    glDispatchCompute((static_cast<GLuint>(open.size()) + kGroupSize - 1) / kGroupSize, 1, 1);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT);
  }

  void read(std::vector<std::uint32_t>& proved) const {
    proved_.read(0, proved.size() * sizeof(std::uint32_t), proved.data());
  }

 private:
  gl::Buffer corners_, open_, proved_;
};

GlCertificate::GlCertificate(const ToleranceVolume& volume) : volume_(&volume), renderer_(gl::renderer().name()) {
  const std::vector<WitnessTriangle>& reference = volume.witnesses();
  const auto coordinates = [&](glm::dvec3 WitnessTriangle::*member) {
    std::vector<float> values;
    values.reserve(3 * reference.size());
    for (const WitnessTriangle& t : reference) {
      for (int k = 0; k < 3; ++k) values.push_back(static_cast<float>((t.*member)[k]));
    }
    return values;
  };
  const std::vector<float> a = coordinates(&WitnessTriangle::a), ab = coordinates(&WitnessTriangle::ab),
                           ac = coordinates(&WitnessTriangle::ac);
  const std::vector<std::uint32_t>& nodes = volume.grid().triangle;
  gl::run([&] {
    require_room(nodes.size() * sizeof nodes[0], "the ids of the grid's nodes");
    require_room(a.size() * sizeof a[0], "the corners of the reference's triangles");
    program_ = gl::Program({{GL_COMPUTE_SHADER, {"witness.glsl", "split.glsl", "certificate.comp"}}});
    nodes_ = gl::Buffer(nodes), a_ = gl::Buffer(a), ab_ = gl::Buffer(ab), ac_ = gl::Buffer(ac);
  });
}

std::vector<Verdict> GlCertificate::check(const Pieces& pieces, const Options& options) const {
  const std::span<const Triangle> triangles = triangles_of(pieces.corners);
  const std::size_t corners = static_cast<std::size_t>(pieces.corners);
  if (pieces.indices.size() % corners != 0) throw InvalidInput("the face array is not a whole number of faces");
  for (const std::uint32_t i : pieces.indices) {
    if (i >= pieces.points.size()) throw InvalidInput("a face uses point " + std::to_string(i) + ", which is not there");
  }
  std::vector<Verdict> verdicts(pieces.size(), Verdict::unproved);
  const double magnitude = 1 + 2 * volume_->frame_tolerance();
  const double within = volume_->provable(pieces.mapping_error) - float_error(magnitude);
  if (!(within > 0.5 * volume_->frame_tolerance())) return verdicts;
  if (options.progress) options.progress->begin("checking");

  const DistanceGrid& grid = volume_->grid();
  const auto set_up = [&] {
    program_.use();
    nodes_.bind_storage(3), a_.bind_storage(4), ab_.bind_storage(5), ac_.bind_storage(6);
    program_.set("origin", glm::vec3(grid.origin));
    program_.set("spacing", static_cast<float>(grid.spacing));
    program_.set("nodes", grid.nodes);
    program_.set("pitch", grid.pitch);
    program_.set("within2", threshold(within));
    program_.set("shortest", static_cast<float>(kShortest * within));
  };

  const std::size_t per_batch = kBatch / triangles.size();
  std::optional<Batch> batch;
  gl::run([&] { batch.emplace(std::min(pieces.size(), per_batch) * triangles.size()); });
  std::vector<float> sent;
  std::vector<std::uint32_t> open, proved;
  for (std::size_t begin = 0; begin < pieces.size(); begin += per_batch) {
    const std::size_t count = std::min(per_batch, pieces.size() - begin);
    if (options.progress) options.progress->update(double(begin) / double(pieces.size()));
    sent.resize(9 * count * triangles.size());
    parallel_for(count, 1 << 12, options.threads, [&](std::size_t first, std::size_t last) {
      float* to = sent.data() + 9 * first * triangles.size();
      for (std::size_t i = first; i < last; ++i) {
        const std::uint32_t* const corner = pieces.indices.data() + (begin + i) * corners;
        for (const Triangle& t : triangles) {
          for (const std::uint32_t k : {t.a, t.b, t.c}) {
            const glm::dvec3& p = pieces.points[corner[k]];
            // Written so that NaN is far as well: GLSL promises nothing of it.
            for (int axis = 0; axis < 3; ++axis) {
              *to++ = std::abs(p[axis]) <= magnitude ? static_cast<float>(p[axis]) : kFar;
            }
          }
        }
      }
    });
    proved.resize(count * triangles.size());
    open.resize(proved.size());
    std::iota(open.begin(), open.end(), 0u);
    gl::run([&] {
      set_up();
      batch->send(sent);
      batch->look_at(program_, open, 1, 1);
      batch->read(proved);
    });
    std::erase_if(open, [&](std::uint32_t i) { return proved[i] == 1; });
    for (std::size_t first = 0; first < open.size(); first += kSlowBatch) {
      const std::span<const std::uint32_t> part = std::span(open).subspan(first, std::min(kSlowBatch, open.size() - first));
      if (options.progress) options.progress->update(double(begin) / double(pieces.size()));
      gl::run([&] {
        set_up();
        batch->look_at(program_, part, 8, kBudget);
        glFinish();
      });
    }
    if (!open.empty()) gl::run([&] { batch->read(proved); });
    for (std::size_t i = 0; i < count; ++i) {
      const auto first = proved.begin() + std::ptrdiff_t(i * triangles.size());
      if (std::all_of(first, first + std::ptrdiff_t(triangles.size()), [](std::uint32_t p) { return p == 1; })) {
        verdicts[begin + i] = Verdict::inside;
      }
    }
  }
  return verdicts;
}

}  // namespace tolvol

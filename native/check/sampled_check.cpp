// SPDX-License-Identifier: GPL-3.0-or-later
// This is based on [Botsch04, §4]. Candidates are not all drawn in one corner: the framebuffer has several cells, and
// each candidate has one of them, so that a renderer that deals tiles out to its processors can use more than one. The
// framebuffer has no attachments, because nothing is written but the counts.
#include "check/sampled_check.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <future>
#include <numeric>
#include <utility>

#include "base/call.h"
#include "base/errors.h"
#include "gl/context.h"

namespace tolvol {
namespace {

// A side of a cell has at least this many pixels. The tiles of renderers are not larger.
constexpr int kSmallestCell = 64;
// A side of the framebuffer has at least this many pixels. 16 cells keep some processors busy; more make a query slow.
constexpr int kSmallestSide = 256;
// A flush follows after this many triangles. More would leave the caches of a tiled renderer.
constexpr std::size_t kChunk = 1024;
// This many queries are begun before the result of the first is read.
constexpr std::size_t kInFlight = 64;
// A batch ends with the piece that reaches either of these. The first keeps a buffer below the 128 MB that every GL
// allows, the second the wait for a cancelled call below a tenth of a second.
constexpr std::size_t kBatchTriangles = std::size_t{1} << 15;
constexpr std::uint64_t kBatchSamples = std::uint64_t{1} << 21;

std::uint64_t sample_count(float subdivisions) {
  const auto n = static_cast<std::uint64_t>(subdivisions);
  return (n + 1) * (n + 2) / 2;
}

void draw_triangles(std::size_t begin, std::size_t end) {
  for (; begin < end; begin += kChunk) {
    const std::size_t count = std::min(kChunk, end - begin);
    glDrawArrays(GL_TRIANGLES, static_cast<GLint>(3 * begin), static_cast<GLsizei>(3 * count));
    if (count == kChunk) glFlush();
  }
}

}  // namespace

/// Triangles to draw together. The triangles that add to one counter are side by side.
struct SampledCheck::Batch {
  std::vector<SampledTriangle> triangles;
  std::vector<std::size_t> ends;         // holds for each counter where its triangles end
  std::vector<std::uint32_t> labels;     // holds for each counter the label whose sum it is part of
  std::vector<std::uint32_t> not_drawn;  // holds the labels of pieces that cannot be drawn
};

SampledCheck::Programs::Programs(std::string_view sample_counts)
    : query({{GL_VERTEX_SHADER, {"samples.vert"}},
             {GL_FRAGMENT_SHADER, {"samples.glsl", sample_counts, "query_samples.frag"}}}),
      counting({{GL_VERTEX_SHADER, {"samples.vert"}},
                {GL_FRAGMENT_SHADER, {"samples.glsl", sample_counts, "count_samples.frag"}}}) {}

SampledCheck::SampledCheck(const ToleranceVolume& volume, float margin)
    : ToleranceCheck(volume), margin_(margin), renderer_(gl::renderer().name()) {}

std::vector<Verdict> SampledCheck::verdicts(const PlacedPieces& pieces, const Options& options) const {
  std::vector<std::uint32_t> each(pieces.size());
  std::iota(each.begin(), each.end(), 0u);
  return decide(pieces, each, each, false, options);
}

std::vector<Verdict> SampledCheck::group_verdicts(const PlacedPieces& pieces, std::span<const std::int32_t> groups,
                                                  const Options& options) const {
  std::vector<std::uint32_t> order(pieces.size()), labels(pieces.size());
  std::iota(order.begin(), order.end(), 0u);
  if (!std::is_sorted(groups.begin(), groups.end())) {
    std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return groups[a] < groups[b]; });
  }
  for (std::size_t i = 1; i < order.size(); ++i) {
    labels[order[i]] = labels[order[i - 1]] + (groups[order[i]] != groups[order[i - 1]]);
  }
  return decide(pieces, order, labels, true, options);
}

std::vector<Verdict> SampledCheck::decide(const PlacedPieces& pieces, std::span<const std::uint32_t> order,
                                          std::span<const std::uint32_t> labels, bool queries,
                                          const Options& options) const {
  const float bound = this->bound(pieces.mapping_error);
  std::vector<Sum> sums(order.empty() ? 0 : labels[order.back()] + 1);
  std::future<void> drawing;  // draws one batch while the next is made
  for (std::size_t next = 0; next < order.size();) {
    poll();
    if (options.progress) options.progress->update(static_cast<double>(next) / static_cast<double>(order.size()));
    Batch batch = make_batch(pieces, order, labels, next);
    if (drawing.valid()) drawing.get();
    drawing = std::async(std::launch::async, [&, batch = std::move(batch)] { draw(batch, bound, queries, sums); });
  }
  if (drawing.valid()) drawing.get();
  poll();
  std::vector<Verdict> verdicts(pieces.size());
  for (std::size_t i = 0; i < verdicts.size(); ++i) {
    const Sum& sum = sums[labels[i]];
    verdicts[i] = sum.drawn ? verdict(sum.counted, sum.points) : Verdict::unproved;
  }
  return verdicts;
}

/// Makes a batch of the pieces from `next` on, and moves `next` past them.
SampledCheck::Batch SampledCheck::make_batch(const PlacedPieces& pieces, std::span<const std::uint32_t> order,
                                             std::span<const std::uint32_t> labels, std::size_t& next) const {
  Batch batch;
  batch.triangles.reserve(std::min(kBatchTriangles, 4 * (order.size() - next)));
  for (std::uint64_t points = 0;
       next < order.size() && batch.triangles.size() < kBatchTriangles && points < kBatchSamples; ++next) {
    const std::uint32_t piece = order[next], label = labels[piece];
    if (batch.labels.empty() || batch.labels.back() != label) {
      batch.labels.push_back(label);
      batch.ends.push_back(batch.triangles.size());
    }
    const std::size_t first = batch.triangles.size();
    const auto counter = static_cast<std::uint32_t>(batch.labels.size() - 1);
    if (!add_piece(pieces, piece, counter, batch.triangles)) batch.not_drawn.push_back(label);
    for (std::size_t i = first; i < batch.triangles.size(); ++i)
      points += sample_count(batch.triangles[i].subdivisions);
    batch.ends.back() = batch.triangles.size();
  }
  return batch;
}

bool SampledCheck::add_piece(const PlacedPieces& pieces, std::size_t piece, std::uint32_t counter,
                             std::vector<SampledTriangle>& triangles) const {
  const DistanceGrid& grid = volume().grid();
  const double per_spacing = 1 / grid.spacing;
  const std::size_t corners = static_cast<std::size_t>(pieces.corners);
  const std::span<const std::uint32_t> corner = pieces.indices.subspan(piece * corners, corners);
  const auto in_grid = [&](int k) { return (pieces.points[corner[k]] - grid.origin) * per_spacing; };
  return std::ranges::all_of(triangles_of(pieces.corners), [&](const PieceTriangle& t) {
    return add_triangle_samples({in_grid(t[0]), in_grid(t[1]), in_grid(t[2])}, counter, triangles);
  });
}

void SampledCheck::draw(const Batch& batch, float bound, bool queries, std::vector<Sum>& sums) const {
  for (const std::uint32_t label : batch.not_drawn) sums[label].drawn = false;
  if (batch.triangles.empty()) return;
  float largest = 0;
  for (const SampledTriangle& triangle : batch.triangles) largest = std::max(largest, triangle.subdivisions);
  // The cell is a pixel larger on both sides than the margin needs.
  const int cell =
      static_cast<int>(std::bit_ceil(std::max<unsigned>(kSmallestCell, static_cast<unsigned>(largest) + 2)));
  const int side = std::max(cell, kSmallestSide);
  gl::run([&] {
    for (const gl::Program* program : {&programs().query, &programs().counting}) {
      program->set("margin", margin_);
      program->set("cell", cell);
      program->set("cells_log2", std::countr_zero(static_cast<unsigned>(side / cell)));
      use(*program, bound);
    }
    const gl::Framebuffer framebuffer = gl::Framebuffer::without_attachments(side, side);
    framebuffer.bind();
    const gl::VertexArray nothing = gl::VertexArray::make();
    nothing.bind();
    const gl::Buffer triangles(batch.triangles);
    triangles.bind_storage(0);
    if (queries) {
      count_by_query(batch, batch.ends,
                     [&](std::size_t counter, const Sum& sum) { sums[batch.labels[counter]] += sum; });
    } else {
      count_each(batch, sums);
    }
  });
}

/// Draws the triangles between each two of `ends` in an occlusion query and calls found(i, sum) with its count.
template <class Found>
void SampledCheck::count_by_query(const Batch& batch, std::span<const std::size_t> ends, Found&& found) const {
  programs().query.use();
  std::vector<gl::Query> flight;
  const auto begin = [&](std::size_t i) { return i ? ends[i - 1] : 0; };
  for (std::size_t i = 0; i < ends.size() + kInFlight; ++i) {
    const std::size_t place = i % kInFlight;
    if (i >= kInFlight && i - kInFlight < ends.size()) {
      const std::size_t done = i - kInFlight;
      Sum sum{flight[place].result(), 0};
      for (std::size_t k = begin(done); k < ends[done]; ++k)
        sum.points += sample_count(batch.triangles[k].subdivisions);
      found(done, sum);
    }
    if (i >= ends.size()) continue;
    if (flight.size() <= place) flight.emplace_back(GL_SAMPLES_PASSED);
    flight[place].begin();
    draw_triangles(begin(i), ends[i]);
    flight[place].end();
  }
}

/// Asks an occlusion query about each chunk of triangles first. Where a whole chunk is inside, its pieces need no
/// counts of their own.
void SampledCheck::count_each(const Batch& batch, std::vector<Sum>& sums) const {
  std::vector<std::size_t> ends;
  for (std::size_t end = 0; end < batch.triangles.size();)
    ends.push_back(end = std::min(end + kChunk, batch.triangles.size()));
  std::vector<std::size_t> again;
  count_by_query(batch, ends, [&](std::size_t i, const Sum& sum) {
    if (verdict(sum.counted, sum.points) != Verdict::inside) again.push_back(i);
  });
  if (again.empty()) return;
  gl::Buffer counters(batch.labels.size() * sizeof(std::uint32_t), nullptr);
  counters.clear();
  counters.bind_storage(1);
  programs().counting.use();
  for (const std::size_t i : again) {
    draw_triangles(i * kChunk, ends[i]);
    for (std::size_t k = i * kChunk; k < ends[i]; ++k) {
      sums[batch.labels[batch.triangles[k].counter]].points += sample_count(batch.triangles[k].subdivisions);
    }
  }
  std::vector<std::uint32_t> counts(batch.labels.size());
  counters.read(0, counters.bytes(), counts.data());
  for (std::size_t counter = 0; counter < counts.size(); ++counter)
    sums[batch.labels[counter]].counted += counts[counter];
}

}  // namespace tolvol

// SPDX-License-Identifier: GPL-3.0-or-later
// own_check X decimates a unit square of 200 triangles. A check of this program decides: only triangles left of X may
// change. It prints how many triangles remain, and how many of these lie to the right of 0.5.
#include <tolvol/check/changed_faces.h>
#include <tolvol/check/ring_check.h>
#include <tolvol/decimation/decimation.h>
#include <algorithm>
#include <cstdlib>
#include <iostream>

namespace {

class LeftOf final : public tolvol::RingCheck {
 public:
  explicit LeftOf(double x) : x_(x) {}
  void begin(const tolvol::TriangleMesh&, const tolvol::StoredSpace& space) override { x_ = space.frame({x_, 0, 0}).x; }
  std::unique_ptr<Trial> trial() override { return std::make_unique<Asking>(x_); }
  std::string method() const override { return "left of"; }

 private:
  class Asking final : public Trial {
   public:
    explicit Asking(double x) : x_(x) {}
    bool accepts(const tolvol::ChangedFaces& change) override {
      const auto is_left = [&](const auto& face) {
        return std::ranges::all_of(change.before().corners(face.id), [&](const glm::dvec3& p) { return p.x <= x_; });
      };
      return std::ranges::all_of(change.elements(), is_left) && std::ranges::all_of(change.removed(), is_left);
    }
    void commit(const tolvol::ChangedFaces&) override {}

   private:
    double x_;
  };

  double x_;
};

tolvol::TriangleMesh square() {
  constexpr std::uint32_t kSide = 10, kRow = kSide + 1;
  tolvol::TriangleMesh mesh;
  for (std::uint32_t i = 0; i < kRow * kRow; ++i) {
    mesh.vertices.emplace_back(double(i % kRow) / kSide, double(i / kRow) / kSide, 0);
  }
  for (std::uint32_t i = 0; i < kRow * kSide; ++i) {
    if (i % kRow == kSide) continue;
    mesh.triangles.emplace_back(i, i + 1, i + kRow + 1);
    mesh.triangles.emplace_back(i, i + kRow + 1, i + kRow);
  }
  return mesh;
}

}  // namespace

int main(int, char** argv) {
  const tolvol::TriangleMesh mesh = square();
  const tolvol::StoredSpace space(glm::dmat4(1), tolvol::Storage::float64);
  const tolvol::ToleranceVolume volume(mesh.vertices, mesh.triangles, space, 0.01);
  LeftOf check(std::atof(argv[1]));
  tolvol::DecimationOptions options;
  options.baseline = &check;
  const auto result = tolvol::decimate(mesh.vertices, mesh.triangles, space, &volume, options);
  const auto on_the_right = std::ranges::count_if(result.triangles, [&](const glm::uvec3& t) {
    return result.vertices[t.x].x + result.vertices[t.y].x + result.vertices[t.z].x > 1.5;
  });
  std::cout << result.triangles.size() << ' ' << on_the_right << '\n';
}

// SPDX-License-Identifier: GPL-3.0-or-later
/// The witness certificate (check/certificate.h) in a compute shader, in float32: for batches of many small pieces.
#pragma once

#include "check/tolerance_check.h"
#include "gl/objects.h"

namespace tolvol {

/// A verdict is `inside`, as certain as that of Certificate, or `unproved`, never `outside`. A piece is unproved if it
/// is outside; if the grid names no near triangle for it, because nothing here searches for the closest one (this
/// concerns pieces at nearly the tolerance on a coarse grid, and all pieces in the marched part of a grid, which has no
/// ids); or if it would take more than a few thousand parts. All pieces are unproved if float32 would cost more than
/// half of the tolerance, which is so for a tolerance below about 1e-5 of the reference. A check throws GlUnavailable
/// if the context was lost, and then nothing is known. A few million small pieces take a second on two cores without a
/// GPU.
class GlCertificate final : public ToleranceCheck {
 public:
  /// Puts the grid's ids, 4 bytes a node, and the reference, 36 bytes a triangle, on the GPU. Keeps a reference to
  /// `volume`, which must outlive this. Throws ResourceLimit if this GL takes no buffer that large, and GlUnavailable.
  explicit GlCertificate(const ToleranceVolume& volume);

  std::string method() const override { return "gl_certificate"; }
  std::string renderer() const override { return renderer_; }

 private:
  std::vector<Verdict> verdicts(const PlacedPieces& pieces, const Options& options) const override;

  std::string renderer_;
  gl::Buffer nodes_, a_, ab_, ac_;
};

/// What float32 may hide, u = 2^-24: if the shader accepts a piece at the threshold t, every point of the piece is
/// within t + float_error(M) of the triangle, M the largest coordinate magnitude of piece and triangle.
///
/// Derivation. Values sent are rounded to nearest, an error of u. GLSL promises for `precise` +, - and * a correctly
/// rounded result in an unspecified direction, 2u, and for a * b + c one or two such roundings; it promises less for
/// division and dot(), and these only ever choose parameters. Subnormals may be flushed: far below u M here. Per
/// coordinate, in units of u M, all points and corners at most M and differences of two at most 2 M:
/// - the part's corner, an exact convex combination of sent corners: sent 1, its products 2, two sums 4;
/// - the triangle's corner a, sent: 1; ab and ac, sent, together with their parameters: 2;
/// - x, the corner as seen from a: 4;
/// - for the foot: s ab + t ac has products 4; s + t <= 1 as computed may be 1 + 2u: 4; two subtractions 8;
/// - for the edge bc instead: x - ab 4, bc = ac - ab 4, the product 4, the subtraction 4.
/// Either way 30; three coordinates: times sqrt(3), below 52. What the sum of squares and the threshold's own rounding
/// add comes off the threshold, see threshold() in the .cpp. 64 leaves room and is a power of two.
inline double float_error(double magnitude) { return 64 * 0x1p-24 * magnitude; }

}  // namespace tolvol

// SPDX-License-Identifier: GPL-3.0-or-later
/// The checks by the names under which users choose them.
#pragma once

#include <memory>
#include <string>

#include "check/tolerance_check.h"

namespace tolvol {

/// "certificate": the default, see certificate.h. The rest need GL: "gl_certificate", see gl_certificate.h;
/// "occlusion_query", see occlusion_query.h; "paper" and "paper_half_h", see paper.h, which prove nothing. Keeps a
/// reference to `volume`, which must outlive the result. Throws InvalidInput for another name, listing these, and for a
/// volume that the method cannot use; GlUnavailable.
std::unique_ptr<ToleranceCheck> make_check(const std::string& method, const ToleranceVolume& volume);

}  // namespace tolvol

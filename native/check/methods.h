// SPDX-License-Identifier: GPL-3.0-or-later
/// The checks by the names under which users choose them.
#pragma once

#include <memory>
#include <string>

#include "check/tolerance_check.h"

namespace tolvol {

/// Makes the check of this name. "certificate" (certificate.h) is the default. The other checks need GL:
/// "gl_certificate" (gl_certificate.h), "occlusion_query" (occlusion_query.h), and "paper" and "paper_half_h"
/// (paper.h), which prove nothing. Keeps a reference to `volume`, which must outlive the result. Throws InvalidInput
/// for another name, with a list of these, and for a volume that the method cannot use; and GlUnavailable.
std::unique_ptr<ToleranceCheck> make_check(const std::string& method, const ToleranceVolume& volume);

}  // namespace tolvol

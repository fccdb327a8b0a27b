// SPDX-License-Identifier: GPL-3.0-or-later
#include "check/methods.h"

#include "base/errors.h"
#include "check/certificate.h"
#ifdef TOLVOL_GL
#include "check/gl_certificate.h"
#include "check/occlusion_query.h"
#include "check/paper.h"
#endif

namespace tolvol {
namespace {

template <class Check>
std::unique_ptr<ToleranceCheck> make(const ToleranceVolume& volume) {
  return std::make_unique<Check>(volume);
}

#ifdef TOLVOL_GL
template <Paper::Margin kMargin>
std::unique_ptr<ToleranceCheck> make_paper(const ToleranceVolume& volume) {
  return std::make_unique<Paper>(volume, kMargin);
}
#else
std::unique_ptr<ToleranceCheck> without_gl(const ToleranceVolume&) { throw GlUnavailable::not_built(); }
#endif

struct Method {
  const char* name;
  std::unique_ptr<ToleranceCheck> (*make)(const ToleranceVolume&);
};

constexpr Method kMethods[] = {
    {"certificate", make<Certificate>},
#ifdef TOLVOL_GL
    {"gl_certificate", make<GlCertificate>},
    {"occlusion_query", make<OcclusionQuery>},
    {"paper", make_paper<Paper::Margin::half_diagonal>},
    {"paper_half_h", make_paper<Paper::Margin::half_spacing>},
#else
    {"gl_certificate", without_gl},     {"occlusion_query", without_gl}, {"paper", without_gl},
    {"paper_half_h", without_gl},
#endif
};

}  // namespace

std::unique_ptr<ToleranceCheck> make_check(const std::string& method, const ToleranceVolume& volume) {
  std::string names;
  for (const Method& m : kMethods) {
    if (method == m.name) return m.make(volume);
    names += (names.empty() ? "" : ", ") + std::string(m.name);
  }
  throw InvalidInput("unknown method \"" + method + "\"; there are: " + names);
}

}  // namespace tolvol

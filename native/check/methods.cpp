// SPDX-License-Identifier: GPL-3.0-or-later
#include "check/methods.h"


#include "check/certificate.h"
#include "reference/errors.h"

namespace tolvol {
namespace {

template <class Check>
std::unique_ptr<ToleranceCheck> make(const ToleranceVolume& volume) {
  return std::make_unique<Check>(volume);
}

struct Method {
  const char* name;
  std::unique_ptr<ToleranceCheck> (*make)(const ToleranceVolume&);
};

constexpr Method kMethods[] = {
    {"certificate", make<Certificate>},
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

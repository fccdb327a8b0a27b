// SPDX-License-Identifier: GPL-3.0-or-later
/// The Python class ToleranceVolume holds this.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "check/methods.h"
#include "check/tolerance_volume.h"

namespace tolvol::python {

struct Pictures;  // is defined in bind_picture.cpp

struct Volume {
  ToleranceVolume native;
  std::size_t vertices, triangles;
  double seconds = 0;  ///< is the time that building took

  /// Makes a check on first use and keeps it, because checks by GL hold textures and buffers. May be called from any
  /// thread, without the GIL.
  std::shared_ptr<const ToleranceCheck> check(const std::string& method) const {
    const std::lock_guard lock(mutex);
    const auto kept = checks.find(method);
    if (kept != checks.end()) return kept->second;
    return checks[method] = make_check(method, native);
  }
  /// Forgets a check whose GL failed, so that the next use makes it anew.
  void forget(const std::string& method) const {
    const std::lock_guard lock(mutex);
    checks.erase(method);
  }

  mutable std::mutex mutex{};
  mutable std::map<std::string, std::shared_ptr<const ToleranceCheck>> checks{};
  mutable std::mutex drawing{};  ///< is held while a picture is drawn, so that one is drawn at a time
  mutable std::shared_ptr<Pictures> pictures{};
};

}  // namespace tolvol::python

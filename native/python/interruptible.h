// SPDX-License-Identifier: GPL-3.0-or-later
/// A long call of the module runs within an Interruptible: without the GIL, and stopped by its Progress and by Ctrl-C.
#pragma once

#include <pybind11/pybind11.h>

#include <chrono>
#include <optional>

#include "base/call.h"
#include "python/worker.h"

namespace tolvol::python {

class Interruptible {
 public:
  explicit Interruptible(const Progress* progress = nullptr);
  /// Leaves the exception of a signal handler, usually KeyboardInterrupt, set for Python.
  ~Interruptible();
  Interruptible(const Interruptible&) = delete;
  Interruptible& operator=(const Interruptible&) = delete;

 private:
  bool handle_signals();

  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  PyObject *type_ = nullptr, *value_ = nullptr, *traceback_ = nullptr;
  Call call_;
  std::optional<WithoutPython> released_;  ///< comes last, so that nothing fails while the GIL is not held
};

}  // namespace tolvol::python

// SPDX-License-Identifier: GPL-3.0-or-later
/// What a long call of the module runs in: without the GIL, stopped by its Progress and by Ctrl-C.
#pragma once

#include <pybind11/pybind11.h>

#include <chrono>

#include "base/call.h"

namespace tolvol::python {

class Interruptible {
 public:
  explicit Interruptible(const Progress* progress = nullptr);
  /// Leaves the exception of a signal handler, KeyboardInterrupt as a rule, set for Python.
  ~Interruptible();
  Interruptible(const Interruptible&) = delete;
  Interruptible& operator=(const Interruptible&) = delete;

 private:
  bool handle_signals();

  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  PyObject *type_ = nullptr, *value_ = nullptr, *traceback_ = nullptr;
  Call call_;
  PyThreadState* const released_;  ///< begins when all else is there: nothing fails while the GIL is not held
};

}  // namespace tolvol::python

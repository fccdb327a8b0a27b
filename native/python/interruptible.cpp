// SPDX-License-Identifier: GPL-3.0-or-later
#include "python/interruptible.h"

namespace tolvol::python {
namespace {

namespace py = pybind11;

/// A call looks for signals once in this time, because taking the GIL may cost its switch interval, 5 ms.
constexpr std::chrono::milliseconds kBetweenLooks(50);

/// Python runs signal handlers only on its main thread.
bool on_main_thread() {
  const auto threading = py::module_::import("threading");
  return threading.attr("get_ident")().equal(threading.attr("main_thread")().attr("ident"));
}

}  // namespace

Interruptible::Interruptible(const Progress* progress)
    : call_(progress, on_main_thread() ? std::function<bool()>([this] { return handle_signals(); }) : nullptr),
      released_(std::in_place) {}

Interruptible::~Interruptible() {
  released_.reset();
  if (type_) PyErr_Restore(type_, value_, traceback_);
}

/// Tells whether a handler has raised an exception.
bool Interruptible::handle_signals() {
  const auto now = std::chrono::steady_clock::now();
  if (now - last_ < kBetweenLooks) return false;
  last_ = now;
  const py::gil_scoped_acquire acquire;
  if (PyErr_CheckSignals() == 0) return false;
  PyErr_Fetch(&type_, &value_, &traceback_);
  return true;
}

}  // namespace tolvol::python

// SPDX-License-Identifier: GPL-3.0-or-later
/// A Worker runs a function of Python in a thread of its own. Python code of workers runs only while a thread that is
/// no worker waits for it; calls into this module run at any time. A program should have one such thread: if several
/// wait, one of them may go on while workers run for another one.
///
/// The reason is Blender: an operator that Python calls with a context of its own (Context.temp_override) reads this
/// context without the GIL whenever any thread has the GIL (PyC_IsInterpreterActive() with Python 3.11 or older), so
/// that Python code of an ordinary thread corrupts memory now and then.
#pragma once

#include <pybind11/pybind11.h>

#include <chrono>
#include <memory>

namespace tolvol::python {

class Worker {
 public:
  /// Starts a thread that calls `work`. Needs the GIL.
  explicit Worker(pybind11::object work);
  /// Lets workers run until this one has ended, or for the given time. Returns whether this one has ended. Signal
  /// handlers may raise exceptions meanwhile, as in join() and pause().
  bool done(std::chrono::duration<double> time);
  /// Waits until this worker has ended.
  void join();

 private:
  struct State;
  std::shared_ptr<State> state_;
};

/// While one lives, this thread does not have the GIL. A worker then neither runs Python code nor keeps others from it.
class WithoutPython {
 public:
  WithoutPython();
  ~WithoutPython();
  WithoutPython(const WithoutPython&) = delete;
  WithoutPython& operator=(const WithoutPython&) = delete;

 private:
  PyThreadState* const released_;
};

/// Waits for the given time, and lets workers run meanwhile.
void pause(std::chrono::duration<double> time);

}  // namespace tolvol::python

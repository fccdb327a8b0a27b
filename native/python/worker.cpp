// SPDX-License-Identifier: GPL-3.0-or-later
#include "python/worker.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

namespace tolvol::python {
namespace {

namespace py = pybind11;
using Seconds = std::chrono::duration<double>;

/// A thread that waits for less than this lets workers run for this time, if they want to.
constexpr Seconds kGlance(0.01);
/// Nobody waits longer than this.
constexpr Seconds kLongest(1e9);

/// A wait lasts so long. Signals are looked for after each.
constexpr Seconds kOneWait(0.05);

thread_local bool is_worker = false;

/// Decides when workers may run Python code.
class Turns {
 public:
  /// A worker waits here before it runs Python code.
  void take() {
    std::unique_lock lock(mutex_);
    ++waiting_;
    changed_.wait(lock, [this] { return givers_ > 0; });
    --waiting_;
    ++taken_;
    changed_.notify_all();
  }

  /// A worker says that it runs no more Python code for now, or none at all if it gives its `done`.
  void end(bool* done = nullptr) {
    const std::lock_guard lock(mutex_);
    --taken_;
    if (done) *done = true;
    changed_.notify_all();
  }

  /// Waits for the given time or until `done`, and lets workers run Python code meanwhile, unless this thread is a
  /// worker itself. Returns `done`, once no worker runs Python code.
  template <class Done>
  bool give(Seconds time, const Done& done) {
    std::unique_lock lock(mutex_);
    if (is_worker) {
      changed_.wait_for(lock, time, done);
      return done();
    }
    const auto start = std::chrono::steady_clock::now();
    const auto after = [&](Seconds some) {
      return start + std::chrono::duration_cast<std::chrono::steady_clock::duration>(some);
    };
    ++givers_;
    changed_.notify_all();
    changed_.wait_until(lock, after(time), done);
    changed_.wait_until(lock, after(std::max(time, kGlance)), [&] { return done() || (waiting_ == 0 && taken_ == 0); });
    --givers_;
    changed_.wait(lock, [this] { return taken_ == 0 || givers_ > 0; });
    return done();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int waiting_ = 0, taken_ = 0;  ///< workers
  int givers_ = 0;               ///< threads that let workers run
};

/// It lives on at the end of the process, when workers may still wait for their turn.
Turns& turns() {
  static Turns* const turns = new Turns;
  return *turns;
}

/// Waits for `done` in short times, and looks for signals between them. Needs the GIL.
template <class Done>
bool wait_for(Seconds time, const Done& done) {
  for (Seconds left = std::clamp(time, Seconds(0), kLongest);; left -= kOneWait) {
    {
      const WithoutPython released;
      if (turns().give(std::min(left, kOneWait), done)) return true;
    }
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (left <= kOneWait) return false;
  }
}

}  // namespace

struct Worker::State {
  py::object work;
  bool done = false;  ///< guarded by the mutex of the turns
};

Worker::Worker(py::object work) : state_(std::make_shared<State>()) {
  state_->work = std::move(work);
  std::thread([state = state_] {
    is_worker = true;
    turns().take();
    {
      const py::gil_scoped_acquire acquire;
      try {
        state->work();
      } catch (py::error_already_set& error) {
        error.discard_as_unraisable("a worker");
      }
      state->work = {};
    }
    turns().end(&state->done);
  }).detach();
}

bool Worker::done(Seconds time) {
  return wait_for(time, [this] { return state_->done; });
}

void Worker::join() {
  while (!done(kLongest)) continue;
}

WithoutPython::WithoutPython() : released_(PyEval_SaveThread()) {
  if (is_worker) turns().end();
}

WithoutPython::~WithoutPython() {
  if (is_worker) turns().take();
  PyEval_RestoreThread(released_);
}

void pause(Seconds time) {
  wait_for(time, [] { return false; });
}

}  // namespace tolvol::python

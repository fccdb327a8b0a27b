// SPDX-License-Identifier: GPL-3.0-or-later
#include <cmath>

#include "base/errors.h"
#include "python/module.h"
#include "python/worker.h"

namespace tolvol::python {

namespace {

std::chrono::duration<double> required(double seconds) {
  if (std::isnan(seconds)) throw InvalidInput("seconds is not a number");
  return std::chrono::duration<double>(seconds);
}

}  // namespace

void bind_worker(pybind11::module_& module) {
  namespace py = pybind11;
  py::class_<Worker>(
      module, "Worker", py::module_local(),
      R"doc(Calls a function in a thread of its own, for a program that cannot bear Python in other threads.

Python code of workers runs only while a thread that is no worker waits in done(), join() or pause(). Long calls of this
module run at any time. There should be one such thread, and no daemon thread. A worker that waits for anything else waits
in pause(), because the thread that lets it run waits until its Python code has ended or called this module. While a worker
calls this module, it must not hold a lock that another worker or that thread takes.

Blender is such a program: operators that Python calls with Context.temp_override corrupt memory if another thread runs
Python code meanwhile (with Python 3.11 or older).)doc")
      .def(py::init<py::object>(), py::arg("work"), R"doc(Start a thread that calls work().

An exception of work() goes to sys.unraisablehook.)doc")
      .def(
          "done", [](Worker& self, double seconds) { return self.done(required(seconds)); }, py::arg("seconds") = 0.0,
          R"doc(Let workers run until this one has ended, for at most so many seconds, and tell whether it has ended.

With few or no seconds it takes up to 0.01 s if workers want to run Python code, and longer if a piece of their code does.
Ctrl-C on the main thread raises KeyboardInterrupt, as in join() and pause().)doc")
      .def("join", &Worker::join, "Wait until this worker has ended.");
  module.def(
      "pause", [](double seconds) { pause(required(seconds)); }, py::arg("seconds"),
      R"doc(Wait for so many seconds without the GIL, and let workers run meanwhile unless this thread is one.

A worker then also waits for its turn to run Python code.)doc");
}

}  // namespace tolvol::python

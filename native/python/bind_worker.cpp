// SPDX-License-Identifier: GPL-3.0-or-later
#include <optional>

#include "python/module.h"
#include "python/worker.h"

namespace tolvol::python {

void bind_worker(pybind11::module_& module) {
  namespace py = pybind11;
  using Seconds = std::chrono::duration<double>;
  py::class_<Worker>(
      module, "Worker", py::module_local(),
      R"doc(Calls a function in a thread of its own, for a program that cannot bear Python in other threads.

Python code of workers runs only while a thread that is no worker waits in done(), join() or pause(). Long calls of this
module run at any time. A worker that waits for anything else waits in pause(): who lets it run waits until its Python code
has ended or called this module. It must not hold a lock while it calls this module.

Blender is such a program: operators that Python calls with Context.temp_override corrupt memory if another thread runs
Python code meanwhile (with Python 3.11 or older).)doc")
      .def(py::init<py::object>(), py::arg("work"), R"doc(Start a thread that calls work().

An exception of work() goes to sys.unraisablehook.)doc")
      .def(
          "done", [](Worker& self, double seconds) { return self.done(Seconds(seconds)); }, py::arg("seconds") = 0.0,
          R"doc(Let workers run until this one has ended, for at most so many seconds, and tell whether it has ended.

With few or no seconds it takes up to 0.01 s, if workers want to run Python code, and longer if their code does.)doc")
      .def("join", &Worker::join,
           "Wait until this worker has ended. Ctrl-C on the main thread raises KeyboardInterrupt.");
  module.def(
      "pause", [](double seconds) { pause(Seconds(seconds)); }, py::arg("seconds"),
      "Wait for so many seconds without the GIL. Workers may run meanwhile, unless this thread is one.");
}

}  // namespace tolvol::python

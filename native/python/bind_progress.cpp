// SPDX-License-Identifier: GPL-3.0-or-later
#include "base/progress.h"

#include <optional>

#include "base/errors.h"
#include "python/module.h"

namespace tolvol::python {
namespace {

/// The context manager that Progress.part() returns.
class PartOf {
 public:
  PartOf(Progress* progress, double first, double last) : progress_(progress), first_(first), last_(last) {}
  void enter() { part_.emplace(progress_, first_, last_); }
  void exit() { part_.reset(); }

 private:
  Progress* progress_;
  double first_, last_;
  std::optional<Progress::Part> part_;
};

}  // namespace

void bind_progress(pybind11::module_& module) {
  namespace py = pybind11;
  py::class_<PartOf>(module, "_Part", py::module_local())
      .def("__enter__", &PartOf::enter)
      .def("__exit__", [](PartOf& of, const py::args&) { of.exit(); });
  py::class_<Progress>(module, "Progress", py::module_local(),
                       R"doc(Shows to another thread how far a long call is, and lets that thread stop it.

There are no callbacks: the other thread reads the attributes from time to time. Use a new object for each call, or for
some calls that are steps of one.)doc")
      .def(py::init<>(), "Make an object for one call.")
      .def_property_readonly("fraction", &Progress::fraction,
                             "The share of the current stage that is done, from 0 to 1.")
      .def_property_readonly("stage", &Progress::stage, "The name of the current stage, in a few words.")
      .def(
          "part",
          [](Progress& progress, double first, double last) {
            if (!(0 <= first && first <= last && last <= 1)) {
              throw InvalidInput("a part of the progress is from first to last, with 0 <= first <= last <= 1");
            }
            return std::make_unique<PartOf>(&progress, first, last);
          },
          py::arg("first"), py::arg("last"), py::keep_alive<0, 1>(),
          R"doc(Return a context manager: within it, the fractions of calls are a part of what they would be without it.

So several calls are one to whoever reads the fraction: part(0, 0.5) for the first of two, part(0.5, 1) for the second. A
context is entered once, by the thread that makes the calls and while none is under way; contexts end in the reverse order.

Raises
------
InvalidInput
    Unless 0 <= first <= last <= 1.)doc")
      .def_property_readonly("count", &Progress::count,
                             "A number that belongs to the stage: in decimation the triangles that are left.")
      .def_property_readonly("cancelled", &Progress::cancelled, "Whether cancel() was called.")
      .def("cancel", &Progress::cancel, R"doc(Ask the call to stop. It then raises Cancelled within 0.2 s.

Ctrl-C stops a call on the main thread as well, with KeyboardInterrupt or whatever the handler of the signal raises.)doc")
      .def_property_readonly("finishing", &Progress::finishing, "Whether finish() was called.")
      .def("finish", &Progress::finish,
           R"doc(Ask a call that improves its result step by step for the result that it has.

This is decimate in the stage "refining". Other calls go on.)doc");
}

}  // namespace tolvol::python

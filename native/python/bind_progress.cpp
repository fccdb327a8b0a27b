// SPDX-License-Identifier: GPL-3.0-or-later
#include "base/progress.h"
#include "python/module.h"

namespace tolvol::python {

void bind_progress(pybind11::module_& module) {
  namespace py = pybind11;
  py::class_<Progress>(module, "Progress", py::module_local(),
                       R"doc(Shows to another thread how far a long call is, and lets that thread stop it.

There are no callbacks: the other thread reads the attributes from time to time. Use a new object for each call, or for
some calls that are steps of one.)doc")
      .def(py::init<>(), "Make an object for one call.")
      .def_property_readonly("fraction", &Progress::fraction,
                             "The share of the current stage that is done, from 0 to 1.")
      .def_property_readonly("stage", &Progress::stage, "The name of the current stage, in a few words.")
      .def(
          "show_as", &Progress::show_as, py::arg("first"), py::arg("last"),
          R"doc(Make the next call the part from `first` to `last` of its stage, so that two calls of a kind look like one.

For this, the first call is shown as 0 to 0.5 and the second one as 0.5 to 1.)doc")
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

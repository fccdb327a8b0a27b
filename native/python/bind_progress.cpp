// SPDX-License-Identifier: GPL-3.0-or-later
#include "base/progress.h"
#include "python/module.h"

namespace tolvol::python {

void bind_progress(pybind11::module_& module) {
  namespace py = pybind11;
  py::class_<Progress>(
      module, "Progress", py::module_local(),
      "What a long call shows to another thread, and how that thread stops it. Poll it; there are no callbacks.")
      .def(py::init<>())
      .def_property_readonly("fraction", &Progress::fraction, "Share of the current stage that is done, 0 to 1.")
      .def_property_readonly("stage", &Progress::stage, "What is being done, in a few words.")
      .def_property_readonly("count", &Progress::count, "What the stage counts: for decimation the triangles left.")
      .def_property_readonly("cancelled", &Progress::cancelled)
      .def("cancel", &Progress::cancel,
           "Asks the call to stop; it then raises Cancelled within 0.2 s. Ctrl-C in a call on the main thread does the "
           "same, "
           "with KeyboardInterrupt or\n"
           "whatever the handler of the signal raises.")
      .def_property_readonly("finishing", &Progress::finishing)
      .def("finish", &Progress::finish,
           "Asks a call that improves its result step by step, decimate() in stage \"refining\", for the one it has.");
}

}  // namespace tolvol::python

// The compiled module `driftwalk._core`: one registration function per subject.
#include <nanobind/nanobind.h>

void register_ks(nanobind::module_& module);
void register_steps(nanobind::module_& module);
void register_simulate(nanobind::module_& module);
void register_faces(nanobind::module_& module);
void register_assemble(nanobind::module_& module);
void register_live(nanobind::module_& module);
void register_tanks(nanobind::module_& module);
void register_infer(nanobind::module_& module);

NB_MODULE(_core, module) {
  module.doc() = "Native core of driftwalk. Private: use the functions of the stages instead.";
  register_ks(module);
  register_steps(module);
  register_simulate(module);
  register_faces(module);
  register_assemble(module);
  register_live(module);
  register_tanks(module);
  register_infer(module);
}

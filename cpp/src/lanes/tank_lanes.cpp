// The kernels of worlds that keep their state, compiled once per instruction set.
#include "driftwalk/assembly/tank_group.hpp"
#include "driftwalk/physics/laws/mixed.hpp"

DRIFTWALK_LANES_BEGIN

namespace {
template <class Real>
constexpr auto kernel_of() {
  using T = typename Numbers<Real>::Scalar;
  return TankKernel<T>{run_group<Real, T>, Numbers<Real>::lanes, PackMemory<Real>::bytes,
                       KeptLayout<Real>::bytes};
}
} // namespace

DRIFTWALK_LANES_END

driftwalk::TankKernels driftwalk::DRIFTWALK_PER_ISA(tank_kernels_)() {
  return {kernel_of<FloatPack<assembly_lanes>>(), kernel_of<DoublePack<native_doubles>>()};
}

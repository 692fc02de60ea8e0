// The numbers of a model, the same for every world of a batch. Each is declared once, in this list:
// the fields of ModelNumbers, their check, and the arguments and attributes of Python's `Model`
// (cpp/bindings/model.hpp) are made from it.
#pragma once

namespace driftwalk {

// The kernels keep the flow at every strip of a block on the stack.
inline constexpr int most_strips = 64; // on a face

// What a number may be; no number may be a NaN or infinite.
enum class Range { any, not_negative, positive, share, strip_count };

// NUMBER(type, name, unit, range). A radius of 0 says that the outline is a polygon, or for the
// view that there is none.
#define DRIFTWALK_MODEL_NUMBERS(NUMBER)                                                            \
  /* block */                                                                                      \
  NUMBER(double, side, "m", positive)                                                              \
  NUMBER(double, mass, "kg", positive)                                                             \
  NUMBER(double, inertia, "kg m^2", positive)                                                      \
  NUMBER(double, depth, "m", positive)                /* of the wetted sides */                    \
  NUMBER(int, strips, "1", strip_count)               /* a side */                                 \
  NUMBER(double, disc_radius, "m", not_negative)      /* 0: the body has corners */                \
  NUMBER(double, added_mass_share, "1", not_negative) /* of the mass, and of the inertia */        \
  /* water */                                                                                      \
  NUMBER(double, water_density, "kg/m^3", positive)                                                \
  NUMBER(double, linear_drag, "kg/s", not_negative)  /* of all strips together */                  \
  NUMBER(double, drag_power, "1", positive)          /* of the speed */                            \
  NUMBER(double, drag_speed, "m/s", positive)        /* at which C_d holds for every power */      \
  NUMBER(double, displaced_mass, "kg", not_negative) /* 0: water that accelerates does not push */ \
  /* wall */                                                                                       \
  NUMBER(double, radius, "m", not_negative)                                                        \
  NUMBER(double, restitution, "1", share)                                                          \
  NUMBER(double, friction, "1", not_negative)                                                      \
  NUMBER(double, bounce_speed, "m/s", not_negative)                                                \
  /* nodes of the flow */                                                                          \
  NUMBER(double, origin_x, "m", any)                                                               \
  NUMBER(double, origin_y, "m", any)                                                               \
  NUMBER(double, spacing_x, "m", positive)                                                         \
  NUMBER(double, spacing_y, "m", positive)                                                         \
  /* time */                                                                                       \
  NUMBER(double, time_step, "s", positive)                                                         \
  NUMBER(int, steps_per_interval, "1", positive)  /* force interval / time step */                 \
  NUMBER(double, force_lever, "m", not_negative)  /* of the force's torque, rms */                 \
  NUMBER(double, force_memory, "s", not_negative) /* time after which the force has forgotten */   \
  /* camera: noise and resolution */                                                               \
  NUMBER(double, position_noise, "m", not_negative)                                                \
  NUMBER(double, orientation_noise, "rad", not_negative)                                           \
  NUMBER(double, position_quantum, "m", not_negative)                                              \
  /* what it sees; samples outside are missing (NaN) */                                            \
  NUMBER(double, view_radius, "m", not_negative)                                                   \
  NUMBER(double, view_x, "m", any)                                                                 \
  NUMBER(double, view_y, "m", any)

struct ModelNumbers {
#define DRIFTWALK_FIELD(type, name, unit, range) type name = 0;
  DRIFTWALK_MODEL_NUMBERS(DRIFTWALK_FIELD)
#undef DRIFTWALK_FIELD
};

// Calls visit(name, unit, range, pointer to the field) for each number in turn.
template <class Visit>
void each_model_number(const Visit& visit) {
#define DRIFTWALK_VISIT(type, name, unit, range)                                                   \
  visit(#name, unit, Range::range, &ModelNumbers::name);
  DRIFTWALK_MODEL_NUMBERS(DRIFTWALK_VISIT)
#undef DRIFTWALK_VISIT
}

// Throws std::invalid_argument for the first number that is out of its range.
void check_model_numbers(const ModelNumbers& numbers);

} // namespace driftwalk

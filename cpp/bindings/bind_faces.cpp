// Binding of the rules of typed faces.
#include "model.hpp"

#include "driftwalk/assembly/face_rules.hpp"

#include <algorithm>

using namespace nb::literals;

namespace {

using driftwalk::FaceRules;
using Table = In<std::int32_t, 2>;

// One row of `width` entries from 0 to below `limit` per kind, or type.
void require(const Table& table, std::size_t rows, std::size_t width, int low, int limit) {
  const auto bad = [&](std::int32_t value) { return value < low || value >= limit; };
  if (table.shape(0) != rows || table.shape(1) != width ||
      std::any_of(table.data(), table.data() + rows * width, bad)) {
    throw std::invalid_argument("typed faces: a table has another shape, or an entry out of range");
  }
}

void make_rules(FaceRules* self, const Table& latches, const Table& type, const Table& pole,
                In<std::int32_t, 1> count, const Table& becomes) {
  const std::size_t types = latches.shape(0), kinds = type.shape(0);
  if (types < 1 || types > driftwalk::most_face_types || kinds < 1 ||
      kinds > driftwalk::most_kinds || count.size() != kinds) {
    throw std::invalid_argument("typed faces: 1 to 32 types and kinds");
  }
  require(latches, types, types, 0, 2);
  require(type, kinds, 4, 0, static_cast<int>(types));
  require(pole, kinds, 4, -1, 2);
  require(becomes, kinds * 4, types, 0, static_cast<int>(kinds));
  new (self) FaceRules;
  self->kinds = static_cast<int>(kinds);
  for (std::size_t t = 0; t < types * types; ++t) {
    self->latches[t / types] |= static_cast<std::uint32_t>(latches.data()[t]) << (t % types);
  }
  std::int32_t end = 0;
  for (std::size_t k = 0; k < kinds; ++k) {
    if (count.data()[k] < 0 || count.data()[k] > 1'000'000) {
      throw std::invalid_argument("typed faces: a count is out of range");
    }
    self->ends[k] = end += count.data()[k];
    for (std::size_t f = 0; f < 4; ++f) {
      self->type[k][f] = static_cast<std::uint8_t>(type.data()[4 * k + f]);
      self->pole[k][f] = static_cast<std::int8_t>(pole.data()[4 * k + f]);
      for (std::size_t t = 0; t < types; ++t) {
        self->becomes[k][f][t] = static_cast<std::uint8_t>(becomes.data()[(4 * k + f) * types + t]);
      }
    }
  }
  if (end < 1) {
    throw std::invalid_argument("typed faces: no block at the start");
  }
}

} // namespace

void register_faces(nb::module_& module);
void register_faces(nb::module_& module) {
  nb::class_<FaceRules>(module, "FaceRules")
      .def("__init__", &make_rules, nb::kw_only(), "latches"_a, "type"_a, "pole"_a, "count"_a,
           "becomes"_a);
}

#include "driftwalk/simulate/model_numbers.hpp"

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>

namespace driftwalk {

namespace {
bool lies_in(Range range, double value) {
  switch (range) {
  case Range::any:
    return std::isfinite(value);
  case Range::not_negative:
    return std::isfinite(value) && value >= 0;
  case Range::positive:
    return std::isfinite(value) && value > 0;
  case Range::share:
    return value >= 0 && value <= 1;
  case Range::strip_count:
    return value >= 1 && value <= most_strips;
  }
  return false;
}

std::string words_of(Range range) {
  switch (range) {
  case Range::any:
    return "finite";
  case Range::not_negative:
    return "finite and not negative";
  case Range::positive:
    return "finite and positive";
  case Range::share:
    return "from 0 to 1";
  case Range::strip_count:
    return "from 1 to " + std::to_string(most_strips);
  }
  return "";
}
} // namespace

void check_model_numbers(const ModelNumbers& numbers) {
  each_model_number([&](const char* name, const char* unit, Range range, auto field) {
    const double value = numbers.*field;
    if (!lies_in(range, value)) {
      std::ostringstream sentence;
      sentence << name << " [" << unit << "] must be " << words_of(range) << ", not " << value;
      throw std::invalid_argument(sentence.str());
    }
  });
}

} // namespace driftwalk

// The smallest thing that can fail: CHECK a condition, report every one that does not hold, and
// return the number of failures from main.
#pragma once

#include <cstdio>

namespace check {

inline int failures = 0;

inline void that(bool holds, const char* text, const char* file, int line) {
  if (!holds) {
    std::fprintf(stderr, "%s:%d: CHECK(%s) failed\n", file, line, text);
    ++failures;
  }
}

inline int result() {
  if (failures > 0) {
    std::fprintf(stderr, "%d checks failed\n", failures);
  }
  return failures == 0 ? 0 : 1;
}

} // namespace check

#define CHECK(condition) check::that(static_cast<bool>(condition), #condition, __FILE__, __LINE__)
#define CHECK_NEAR(a, b, tolerance)                                                                \
  check::that(((a) - (b)) <= (tolerance) && ((b) - (a)) <= (tolerance), #a " near " #b, __FILE__,  \
              __LINE__)

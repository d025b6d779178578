#pragma once

#include <algorithm>
#include <chrono>

namespace graspatlas {

using Clock = std::chrono::steady_clock;

/// When so many seconds will have passed; any number beyond the clock's range stands for ever.
inline Clock::time_point deadline_after(double seconds) {
  constexpr double kLongest = 1e6;
  return Clock::now() +
         std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(std::min(seconds, kLongest)));
}

/// Seconds since a time.
inline double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace graspatlas

#pragma once

#include <cmath>
#include <cstdint>

namespace graspatlas {

/// Random numbers that are the same on every machine: the generator splitmix64.
class SplitMix64 {
 public:
  explicit SplitMix64(std::uint64_t seed) : state_(seed) {}

  std::uint64_t bits() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }

  /// In [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }

  /// Of mean 0 and variance 1, by Box and Muller's method.
  double normal() {
    const double length = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return length * std::cos(2.0 * M_PI * uniform());
  }

 private:
  std::uint64_t state_;
};

}  // namespace graspatlas

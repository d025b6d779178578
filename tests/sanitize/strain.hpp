#pragma once

#include <cmath>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "graspatlas/errors.hpp"
#include "graspatlas/parallel.hpp"

/// What the parts of the sanitizer program share. A sanitizer ends the program at the first fault; a wrong answer ends
/// it through `require`.
namespace strain {

inline void require(bool holds, const std::string& claim) {
  if (!holds) throw std::runtime_error("does not hold: " + claim);
}

/// Requires that `work` throws graspatlas::Error with `part` in its message.
template <class Work>
void refuse(Work work, const std::string& part) {
  try {
    work();
  } catch (const graspatlas::Error& error) {
    require(std::string(error.what()).find(part) != std::string::npos,
            "message '" + std::string(error.what()) + "' says '" + part + "'");
    return;
  }
  require(false, "an error that says '" + part + "' is thrown");
}

/// Runs work(user) in so many threads at the same time, as a program that uses the library from several threads does.
template <class Work>
void together(int users, Work work) {
  graspatlas::run_on_threads(users, work);
}

/// Random numbers, the same in every run.
class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  double normal() { return std::normal_distribution<double>()(engine_); }
  int below(int limit) { return std::uniform_int_distribution<int>(0, limit - 1)(engine_); }
  /// A unit vector of R^n.
  std::vector<double> direction(int n) {
    std::vector<double> d(n);
    double squared = 0.0;
    while (!(squared > 1e-6)) {
      squared = 0.0;
      for (double& c : d) {
        c = normal();
        squared += c * c;
      }
    }
    for (double& c : d) c /= std::sqrt(squared);
    return d;
  }

 private:
  std::mt19937 engine_;
};

void arms();
void atlases();
void climbs();
void collisions();
void fronts();
void grasps();
void misuse();
void neighbours();
void polytopes();
void users();
void pictures();

}  // namespace strain

#include <chrono>
#include <cstdio>
#include <exception>
#include <utility>

#include "strain.hpp"

/// Runs every part; exit status 1 when one finds a wrong answer. Memory faults and undefined behaviour end the program.
int main() {
  using Part = std::pair<const char*, void (*)()>;
  const Part parts[] = {
      {"polytopes", strain::polytopes}, {"neighbours", strain::neighbours}, {"fronts", strain::fronts},
      {"atlases", strain::atlases},     {"misuse", strain::misuse},         {"users", strain::users},
      {"pictures", strain::pictures},
#ifdef GRASPATLAS_WITH_GRASPS
      {"grasps", strain::grasps},       {"collisions", strain::collisions}, {"climbs", strain::climbs},
      {"arms", strain::arms},
#endif
  };
  for (const auto& [name, run] : parts) {
    const auto start = std::chrono::steady_clock::now();
    try {
      run();
    } catch (const std::exception& error) {
      std::printf("%s: %s\n", name, error.what());
      return 1;
    }
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    std::printf("%-12s ok, %.1f s\n", name, seconds.count());
    std::fflush(stdout);
  }
  return 0;
}

#include "graspatlas/errors.hpp"

#include <cstdio>

namespace graspatlas {

std::string to_text(double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", number);
  return text;
}

}  // namespace graspatlas

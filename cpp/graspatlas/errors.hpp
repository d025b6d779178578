#pragma once

#include <stdexcept>
#include <string>

namespace graspatlas {

/// Base of every error that this library raises; Python sees it as graspatlas.GraspAtlasError.
struct Error : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A number in a message, three digits.
std::string to_text(double number);

}  // namespace graspatlas

#include "graspatlas/grasp/piecewise_cubic.hpp"

#include <algorithm>
#include <utility>

#include "graspatlas/errors.hpp"

namespace graspatlas {

PiecewiseCubic::PiecewiseCubic(std::vector<double> breaks, const Eigen::Matrix<double, Eigen::Dynamic, 4>& coefficients,
                               const std::string& what)
    : breaks_(std::move(breaks)), coefficients_(coefficients) {
  if (coefficients_.rows() < 1 || static_cast<Eigen::Index>(breaks_.size()) != coefficients_.rows() + 1)
    throw Error(what + " of n pieces needs n + 1 breaks; got " + std::to_string(coefficients_.rows()) + " pieces and " +
                std::to_string(breaks_.size()) + " breaks");
  for (std::size_t i = 1; i < breaks_.size(); ++i)
    if (!(breaks_[i - 1] < breaks_[i])) throw Error("the breaks of " + what + " must ascend");
}

PiecewiseCubic::Value PiecewiseCubic::evaluate(double t) const {
  Eigen::Index piece = 0;
  if (coefficients_.rows() > 1) {
    const auto above = std::upper_bound(breaks_.begin() + 1, breaks_.end() - 1, t);
    piece = above - breaks_.begin() - 1;
  }
  const auto c = coefficients_.row(piece);
  const double s = t - breaks_[static_cast<std::size_t>(piece)];
  return {c(0) + s * (c(1) + s * (c(2) + s * c(3))), c(1) + s * (2.0 * c(2) + s * 3.0 * c(3)),
          2.0 * c(2) + 6.0 * s * c(3)};
}

}  // namespace graspatlas

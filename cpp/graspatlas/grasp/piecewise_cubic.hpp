#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace graspatlas {

/// A function of one number by cubic pieces: f(t) = c0 + c1 s + c2 s^2 + c3 s^3 with s = t - break. Beyond the ends the
/// end pieces go on, since Newton may pass there on its way.
class PiecewiseCubic {
 public:
  /// A value with its first and second derivatives.
  struct Value {
    double value, first_derivative, second_derivative;
  };

  /// `breaks` ascend, one more than there are rows of `coefficients` [pieces x 4]; `what` names the function in errors.
  PiecewiseCubic(std::vector<double> breaks, const Eigen::Matrix<double, Eigen::Dynamic, 4>& coefficients,
                 const std::string& what);
  Value evaluate(double t) const;
  const std::vector<double>& breaks() const { return breaks_; }
  const Eigen::Matrix<double, Eigen::Dynamic, 4>& coefficients() const { return coefficients_; }

 private:
  std::vector<double> breaks_;
  Eigen::Matrix<double, Eigen::Dynamic, 4> coefficients_;
};

}  // namespace graspatlas

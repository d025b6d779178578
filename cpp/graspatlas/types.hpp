#pragma once

#include <Eigen/Core>

namespace graspatlas {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;
/// A matrix whose rows are contiguous, as those of NumPy are.
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace graspatlas

#include "graspatlas/quality/manipulability.hpp"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "graspatlas/errors.hpp"

namespace graspatlas {

namespace {

// A singular value this far below the largest counts as zero: the rank of J, of G, of the constraint between
// them.
constexpr double kRankTolerance = 1e-9;

}  // namespace

Manipulability::Manipulability(GraspSystem& system, double length_unit) : system_(system), length_unit_(length_unit) {
  if (system.object_dof() == 0 || system.contact_count() == 0)
    throw Error("manipulability needs an object and at least one contact");
  if (!(length_unit > 0.0) || !std::isfinite(length_unit))
    throw Error("length_unit must be positive, got " + to_text(length_unit));
  J_.resize(3 * system.contact_count(), system.actuated_count());
  Gt_.resize(3 * system.contact_count(), system.object_dof());
}

void Manipulability::semi_axes(const double* x, double* out) {
  const int dof = system_.object_dof();
  std::fill_n(out, dof, 0.0);
  system_.grasp_matrices(x, J_, Gt_);
  const int lengths = system_.object_joint().lengths();
  J_ /= length_unit_;
  Gt_.rightCols(dof - lengths) /= length_unit_;

  // J' P = Q [R1 R2; 0 0], so that J+ G' t = Q z with R1' z = (first rows of P' G') t, wherever R2' z agrees
  // with the other rows: those t are the coordinated motions.
  Eigen::ColPivHouseholderQR<Matrix> qr(J_.transpose());
  qr.setThreshold(kRankTolerance);
  const Eigen::Index rank = qr.rank(), rows = J_.rows();
  if (rank == 0) return;
  const Matrix permuted = qr.colsPermutation().transpose() * Gt_;
  const auto& R = qr.matrixR();
  Matrix Z = R.topLeftCorner(rank, rank).triangularView<Eigen::Upper>().transpose().solve(permuted.topRows(rank));
  if (rank < rows) {
    const Matrix mismatch = R.topRightCorner(rank, rows - rank).transpose() * Z - permuted.bottomRows(rows - rank);
    const Eigen::JacobiSVD<Matrix> svd(mismatch, Eigen::ComputeFullV);
    const double scale = std::max(permuted.norm(), 1e-300);
    Eigen::Index constrained = 0;
    while (constrained < svd.singularValues().size() && svd.singularValues()(constrained) > kRankTolerance * scale)
      ++constrained;
    if (constrained == dof) return;
    Z = (Z * svd.matrixV().rightCols(dof - constrained)).eval();
  }
  // Q has orthonormal columns: the singular values of Z are those of J+ G' on the coordinated motions. R, the
  // triangular factor of Z, has the same ones and is smaller.
  if (Z.rows() < Z.cols()) return;
  Eigen::HouseholderQR<Matrix> small(Z);
  const Eigen::Index axes = Z.cols();
  const Matrix T = small.matrixQR().topRows(axes).triangularView<Eigen::Upper>();
  const Eigen::JacobiSVD<Matrix> svd(T);
  const auto& sigma = svd.singularValues();
  // An object motion that takes no joint velocity: beside the others, or beside what grasps of this size take.
  const double usual = std::max(sigma(0), Gt_.norm() / J_.norm());
  if (!(sigma(axes - 1) > kRankTolerance * usual)) return;
  for (Eigen::Index i = 0; i < axes; ++i) out[dof - axes + i] = 1.0 / sigma(i);
}

int Manipulability::connectivity(const double* x) {
  Vector axes(system_.object_dof());
  semi_axes(x, axes.data());
  return static_cast<int>((axes.array() > 0.0).count());
}

}  // namespace graspatlas

#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "graspatlas/types.hpp"

namespace graspatlas {

/// A system of equations R(x) = 0 whose solutions form a manifold of dimension k = tangent_size -
/// equation_count.
///
/// Points x live in a configuration space with its own addition: `integrate` computes x (+) v and
/// `difference` computes v = x1 (-) x0, with the identities
///
///   difference(x, integrate(x, v)) = v  for small v,      difference(x1, x0) = -difference(x0, x1).
///
/// In R^n these are plain addition and subtraction, the default. Every array below belongs to the caller and
/// has the size named; a matrix is row-major.
///
/// What is const may be called by any number of threads at the same time. What is not may write to scratch of the
/// system: a thread that shares a system with others calls it through a Lease.
class System {
 public:
  /// Sizes: numbers in a point, in a tangent vector, in R(x), and in the embedding of a point.
  System(int configuration_size, int tangent_size, int equation_count, int embedding_size);
  virtual ~System() = default;

  int configuration_size() const { return configuration_size_; }
  int tangent_size() const { return tangent_size_; }
  int equation_count() const { return equation_count_; }
  int embedding_size() const { return embedding_size_; }
  int dimension() const { return tangent_size_ - equation_count_; }

  /// R(x) [equation_count].
  virtual void residual(const double* x, double* R) = 0;

  /// R(x) and its Jacobian J [equation_count x tangent_size] with respect to v in R(x (+) v), at v = 0.
  virtual void linearize(const double* x, double* R, double* J) = 0;

  /// x (+) v [configuration_size]; `out` may be x itself.
  virtual void integrate(const double* x, const double* v, double* out) const;

  /// x1 (-) x0 [tangent_size].
  virtual void difference(const double* x0, const double* x1, double* out) const;

  /// True when two points are one, to within a tolerance [units of the tangent space].
  virtual bool same_point(const double* x0, const double* x1, double tolerance) const;

  /// A point of R^embedding_size such that Euclidean distances never exceed the norm of `difference`; two
  /// names of one configuration (a quaternion and its negative) have one embedding. Charts are looked up by
  /// it.
  virtual void embed(const double* x, double* out) const;

  /// Bounds are linear to first order: slack(x (+) v) = slack(x) - B v + O(|v|^2), and a point is inside when
  /// no slack is negative. B is [bound_count x tangent_size].
  int bound_count() const { return static_cast<int>(bound_normals_.rows()); }
  const RowMatrix& bound_normals() const { return bound_normals_; }
  virtual void slack(const double* x, double* out) const;
  /// What bound i is, for messages.
  virtual std::string bound_name(int i) const;

  /// Throws Error when x names no configuration, such as a quaternion that is not of length one.
  virtual void check_point(const double* x) const;

  /// Charts must be smaller: with angles among the coordinates, displacements of more than half a turn are ambiguous.
  virtual double radius_limit() const;

  /// A copy, of the same class, that another thread may use at the same time; null where there can be none, as for
  /// equations in Python. Then any thread may call the system itself at any time.
  virtual std::unique_ptr<System> clone() const { return nullptr; }

 protected:
  System(const System&) = default;
  void set_bound_normals(const RowMatrix& B) { bound_normals_ = B; }

 private:
  template <class S>
  friend class Lease;

  /// Clones that no lease holds. A copy of a system begins with none.
  class Spares {
   public:
    Spares() = default;
    Spares(const Spares&) {}
    /// A clone; null when there is none.
    std::unique_ptr<System> take();
    void put(std::unique_ptr<System> clone);

   private:
    std::mutex mutex_;
    std::vector<std::unique_ptr<System>> clones_;
  };

  int configuration_size_, tangent_size_, equation_count_, embedding_size_;
  RowMatrix bound_normals_;
  Spares spares_;
};

}  // namespace graspatlas

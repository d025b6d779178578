#pragma once

#include <memory>
#include <utility>

#include "graspatlas/manifold/system.hpp"

namespace graspatlas {

/// A system of the holder's own for as long as the lease lives, so that any number of threads may use one system at the
/// same time: each takes a lease, and evaluates through it alone.
///
/// The lease holds a clone, which goes back to the system in the end and serves the next lease: after the first use by
/// so many threads a lease costs two locks that nobody waits for, some 50 nanoseconds. A system that cannot be cloned
/// lends itself; it must allow what its users do with it. The system must outlive its leases.
template <class S = System>
class Lease {
 public:
  explicit Lease(S& shared) : shared_(&shared), own_(shared.spares_.take()) {
    if (!own_) own_ = shared.clone();
  }
  ~Lease() {
    if (own_) shared_->spares_.put(std::move(own_));
  }
  Lease(const Lease&) = delete;
  Lease& operator=(const Lease&) = delete;

  S& operator*() const { return own_ ? static_cast<S&>(*own_) : *shared_; }
  S* operator->() const { return &**this; }

 private:
  S* shared_;
  std::unique_ptr<System> own_;
};

}  // namespace graspatlas

#include "graspatlas/audit/audit_round.hpp"

#include <algorithm>

#include "graspatlas/clock.hpp"
#include "graspatlas/parallel.hpp"

namespace graspatlas {

namespace {

// Steps that a random walk takes, about, and walks along bounds beside one that is free.
constexpr std::int64_t kPointsOfWalk = 6;
constexpr double kAlongBounds = 0.5;
// Time after which the clock is looked at again, about [s].
constexpr double kPieceSeconds = 0.01;

bool meets_bound(const Polytope& polytope) {
  for (int f = 0; f < polytope.facet_slots(); ++f)
    if (polytope.facet_active(f) && Polytope::is_bound(polytope.tag(f))) return true;
  return false;
}

}  // namespace

AuditRound::AuditRound(const Charts& charts, const Front& front, const AuditState& state, std::int64_t points) {
  std::vector<int> at_bounds;
  for (std::int64_t i = 0; i < front.count(); ++i) {
    const int slot = front.slot(i);
    add_places_of(slot, charts[slot]);
    if (!meets_bound(charts[slot].polytope)) continue;
    at_bounds.push_back(slot);
    if (i >= state.new_first) places_.push_back({Place::Kind::behind_bounds, slot, 0, 0});
  }
  if (state.points == 0) add_walks(front, state, points, at_bounds);
}

void AuditRound::add_places_of(int slot, const Chart& chart) {
  if (chart.rank == Rank::doubtful) places_.push_back({Place::Kind::rank, slot, 0, 0});
  if (!chart.closed) return;
  for (int v = 0; v < chart.polytope.vertex_count(); ++v) {
    const auto reason = static_cast<Closed>(chart.polytope.state(v));
    if (reason == Closed::curvature || reason == Closed::not_converged)
      places_.push_back({Place::Kind::closed_vertex, slot, v, 0});
  }
}

void AuditRound::add_walks(const Front& front, const AuditState& state, std::int64_t points,
                           const std::vector<int>& at_bounds) {
  SplitMix64 random(static_cast<std::uint64_t>(state.rounds));
  const auto one_of = [&random](std::int64_t first, std::int64_t last) {
    return first + static_cast<std::int64_t>(random.uniform() * static_cast<double>(last - first));
  };
  const std::int64_t walks = (points + kPointsOfWalk - 1) / kPointsOfWalk;
  for (std::int64_t i = 0; i < walks; ++i) {
    const bool anew = state.rounds > 0 && i % 2 == 0 && state.new_first < front.count();
    const std::int64_t start = one_of(anew ? state.new_first : 0, front.count());
    places_.push_back({Place::Kind::walk, front.slot(start), 0, random.bits()});
  }
  if (at_bounds.empty()) return;
  for (std::int64_t i = 0; i < static_cast<std::int64_t>(kAlongBounds * static_cast<double>(walks)); ++i) {
    const auto start = static_cast<std::size_t>(one_of(0, static_cast<std::int64_t>(at_bounds.size())));
    places_.push_back({Place::Kind::along_bound, at_bounds[start], 0, random.bits()});
  }
}

bool AuditRound::run(const std::vector<Auditor*>& auditors, double seconds) {
  const Clock::time_point start = Clock::now();
  std::size_t piece = 8 * auditors.size();
  for (double before = 0.0; next_ < places_.size();) {
    const std::size_t count = std::min(piece, places_.size() - next_);
    parallel_for(static_cast<int>(auditors.size()), static_cast<std::int64_t>(count),
                 [&](int worker, std::int64_t first, std::int64_t last) {
                   Auditor& auditor = *auditors[static_cast<std::size_t>(worker)];
                   for (std::int64_t i = first; i < last; ++i)
                     look(auditor, places_[next_ + static_cast<std::size_t>(i)]);
                 });
    next_ += count;
    const double now = seconds_since(start);
    if (now > seconds && next_ < places_.size()) return false;
    piece = now - before < kPieceSeconds ? 2 * piece : std::max<std::size_t>(piece / 2, 1);
    before = now;
  }
  return true;
}

void AuditRound::look(Auditor& auditor, Place& at) {
  switch (at.kind) {
    case Place::Kind::rank:
      at.loses_rank = auditor.loses_rank(at.slot);
      break;
    case Place::Kind::closed_vertex:
      at.reason = auditor.look_beyond(at.slot, at.vertex, at.holes);
      break;
    case Place::Kind::behind_bounds:
      auditor.look_behind_bounds(at.slot, at.holes);
      break;
    case Place::Kind::walk:
      at.points = auditor.walk(at.slot, at.seed, at.holes);
      break;
    case Place::Kind::along_bound:
      at.points = auditor.walk_along_bound(at.slot, at.seed, at.holes);
      break;
  }
}

void AuditRound::apply(Charts& charts) const {
  for (const Place& at : places_) {
    if (at.kind == Place::Kind::rank) charts[at.slot].rank = at.loses_rank ? Rank::lost : Rank::full;
    if (at.kind == Place::Kind::closed_vertex)
      charts[at.slot].polytope.close(at.vertex, static_cast<std::uint8_t>(at.reason));
  }
}

std::vector<const Hole*> AuditRound::holes() const {
  std::vector<const Hole*> out;
  for (const Place& at : places_)
    for (const Hole& hole : at.holes) out.push_back(&hole);
  return out;
}

std::int64_t AuditRound::points() const {
  std::int64_t sum = 0;
  for (const Place& at : places_) sum += at.points;
  return sum;
}

bool AuditRound::walks_found_holes() const {
  return std::any_of(places_.begin(), places_.end(), [](const Place& at) {
    return (at.kind == Place::Kind::walk || at.kind == Place::Kind::along_bound) && !at.holes.empty();
  });
}

}  // namespace graspatlas

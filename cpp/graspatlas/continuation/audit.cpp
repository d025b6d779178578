#include <algorithm>

#include "graspatlas/continuation/atlas.hpp"
#include "graspatlas/parallel.hpp"

namespace graspatlas {

namespace {

// Steps that a random walk takes, about, and walks along bounds beside one that is free.
constexpr std::int64_t kPointsOfWalk = 6;
constexpr double kAlongBounds = 0.5;
// Time after which the clock is looked at again, about [s].
constexpr double kPieceSeconds = 0.01;
// An atlas in which every round of so many finds holes is not audited further.
constexpr std::int64_t kMostRounds = 100;

bool meets_bound(const Polytope& polytope) {
  for (int f = 0; f < polytope.facet_slots(); ++f)
    if (polytope.facet_active(f) && polytope.tag(f) <= Polytope::bound_tag(0)) return true;
  return false;
}

}  // namespace

void Atlas::audit(std::int64_t points, double seconds) {
  if (!complete() || audit_.done) return;
  const auto start = Clock::now();
  if (looks_.empty()) begin_round(points);
  for (auto& worker : workers_)
    if (!worker->auditor)
      worker->auditor = std::make_unique<Auditor>(worker->system ? *worker->system : system_, options_, charts_);
  std::size_t piece = 8 * workers_.size();
  for (double before = 0.0; next_look_ < looks_.size();) {
    const std::size_t count = std::min(piece, looks_.size() - next_look_);
    parallel_for(threads(), static_cast<std::int64_t>(count), [&](int worker, std::int64_t first, std::int64_t last) {
      Auditor& auditor = *workers_[static_cast<std::size_t>(worker)]->auditor;
      for (std::int64_t i = first; i < last; ++i) look(auditor, looks_[next_look_ + static_cast<std::size_t>(i)]);
    });
    next_look_ += count;
    const double now = std::chrono::duration<double>(Clock::now() - start).count();
    if (now > seconds && next_look_ < looks_.size()) return;
    piece = now - before < kPieceSeconds ? 2 * piece : std::max<std::size_t>(piece / 2, 1);
    before = now;
  }
  end_round();
}

void Atlas::look(Auditor& auditor, Look& at) const {
  switch (at.kind) {
    case Look::Kind::rank:
      at.loses_rank = auditor.loses_rank(at.slot);
      break;
    case Look::Kind::closed_vertex:
      at.reason = auditor.look_beyond(at.slot, at.vertex, at.holes);
      break;
    case Look::Kind::behind_bounds:
      auditor.look_behind_bounds(at.slot, at.holes);
      break;
    case Look::Kind::walk:
      at.points = auditor.walk(at.slot, at.seed, at.holes);
      break;
    case Look::Kind::along_bound:
      at.points = auditor.walk_along_bound(at.slot, at.seed, at.holes);
      break;
  }
}

// What a round looks at: every vertex that was closed for want of something better; behind the bounds of all charts
// that are new; charts that may lose rank; random walks, of which every second begins at a chart that is new.
void Atlas::begin_round(std::int64_t points) {
  next_look_ = 0;
  std::vector<int> at_bounds;
  for (std::size_t i = 0; i < order_.size(); ++i) {
    const int slot = order_[i];
    const Chart& chart = charts_[slot];
    if (chart.rank == Rank::doubtful) looks_.push_back({Look::Kind::rank, slot, 0, 0});
    if (chart.closed)
      for (int v = 0; v < chart.polytope.vertex_count(); ++v) {
        const auto reason = static_cast<Closed>(chart.polytope.state(v));
        if (reason == Closed::curvature || reason == Closed::not_converged)
          looks_.push_back({Look::Kind::closed_vertex, slot, v, 0});
      }
    if (!meets_bound(chart.polytope)) continue;
    at_bounds.push_back(slot);
    if (static_cast<std::int64_t>(i) >= audit_.new_first) looks_.push_back({Look::Kind::behind_bounds, slot, 0, 0});
  }
  if (audit_.points == 0) add_walks(points, at_bounds);
}

void Atlas::add_walks(std::int64_t points, const std::vector<int>& at_bounds) {
  Dice dice(static_cast<std::uint64_t>(audit_.rounds));
  const auto one_of = [&dice](std::int64_t first, std::int64_t last) {
    return first + static_cast<std::int64_t>(dice.uniform() * static_cast<double>(last - first));
  };
  const std::int64_t walks = (points + kPointsOfWalk - 1) / kPointsOfWalk;
  for (std::int64_t i = 0; i < walks; ++i) {
    const bool anew = audit_.rounds > 0 && i % 2 == 0 && audit_.new_first < count();
    const auto start = static_cast<std::size_t>(one_of(anew ? audit_.new_first : 0, count()));
    looks_.push_back({Look::Kind::walk, order_[start], 0, dice.bits()});
  }
  if (at_bounds.empty()) return;
  for (std::int64_t i = 0; i < static_cast<std::int64_t>(kAlongBounds * static_cast<double>(walks)); ++i) {
    const auto start = static_cast<std::size_t>(one_of(0, static_cast<std::int64_t>(at_bounds.size())));
    looks_.push_back({Look::Kind::along_bound, at_bounds[start], 0, dice.bits()});
  }
}

// What walks have found covered stays so: they are made again only when one of them found a hole.
void Atlas::end_round() {
  std::int64_t points = 0;
  bool walks_found = false;
  for (const Look& at : looks_) {
    points += at.points;
    if (at.kind == Look::Kind::walk || at.kind == Look::Kind::along_bound)
      walks_found = walks_found || !at.holes.empty();
    if (at.kind == Look::Kind::rank) charts_[at.slot].rank = at.loses_rank ? Rank::lost : Rank::full;
    if (at.kind == Look::Kind::closed_vertex)
      charts_[at.slot].polytope.close(at.vertex, static_cast<std::uint8_t>(at.reason));
  }
  const std::int64_t charts = count();
  const bool found = add_holes();
  looks_.clear();
  looks_.shrink_to_fit();
  if (audit_.points == 0 && !walks_found) audit_.points = points;
  audit_.done = !found || audit_.rounds >= kMostRounds;
  if (found && audit_.done) audit_.points = 0;
  if (audit_.done) return;
  ++audit_.rounds;
  audit_.new_first = charts;
}

// Begins charts at the holes that were found, but for those that one of them covers by now.
bool Atlas::add_holes() {
  Worker& worker = *workers_.front();
  bool found = false;
  for (const Look& at : looks_)
    for (const Hole& hole : at.holes) {
      if (found && worker.auditor->covers(hole.x.data(), hole.Phi.data())) continue;
      found = true;
      worker.expander->start_at(hole.x.data(), hole.Phi.data(), static_cast<ChartKey>(++task_count_) * kMostCharts);
      ++audit_.holes;
    }
  std::vector<int>& reopened = worker.expander->reopened();
  again_.insert(again_.end(), reopened.begin(), reopened.end());
  reopened.clear();
  settle_order();
  return found;
}

}  // namespace graspatlas

#include "graspatlas/atlas/atlas.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "graspatlas/errors.hpp"
#include "graspatlas/parallel.hpp"

namespace graspatlas {

namespace {

// Beside smaller charts rounding and the tolerances of points and polytopes are no longer small.
constexpr double kSmallestRadius = 1e-7;
// An atlas in which every round of so many finds holes is not audited further.
constexpr std::int64_t kMostRounds = 100;

void check_options(const AtlasOptions& options, const System& system) {
  if (!(options.radius > 0.0)) throw Error("radius must be positive, got " + to_text(options.radius));
  if (!(options.radius >= kSmallestRadius))
    throw Error("radius must be at least " + to_text(kSmallestRadius) + ", got " + to_text(options.radius) +
                "; scale the variables of a smaller manifold");
  if (!(options.radius < system.radius_limit()))
    throw Error("radius must be below " + to_text(system.radius_limit()) + " for this system, got " +
                to_text(options.radius));
  if (!(options.epsilon > 0.0) || !(options.epsilon < 1.0))
    throw Error("epsilon must lie between 0 and 1, got " + to_text(options.epsilon));
}

}  // namespace

Atlas::Atlas(System& system, const AtlasOptions& options, int threads)
    : system_(system),
      options_(options),
      charts_(system.configuration_size(), system.dimension() * system.tangent_size(), system.embedding_size(),
              options.radius),
      front_(charts_),
      window_(system, options.radius, front_) {
  check_options(options, system);
  for (int i = 0; i < std::max(threads, 1); ++i) {
    Worker worker;
    worker.system = system.clone();
    if (i > 0 && !worker.system) break;
    worker.expander = std::make_unique<Expander>(worker.system ? *worker.system : system, options, charts_);
    workers_.push_back(std::move(worker));
  }
}

Atlas::Atlas(System& system, const double* x0, const AtlasOptions& options, int threads)
    : Atlas(system, options, threads) {
  for (int i = 0; i < system.configuration_size(); ++i)
    if (!std::isfinite(x0[i])) throw Error("x0 holds a number that is not finite");
  system.check_point(x0);
  workers_.front().expander->start(x0);
  front_.settle();
}

Atlas::Atlas(System& system, const Checkpoint& saved, const AtlasOptions& options, int threads)
    : Atlas(system, options, threads) {
  check_checkpoint(saved, system);
  put_back_charts(saved);
  put_back_closed_vertices(saved);
  front_.restore(saved);
  window_.place_generation();
  // Which charts lose rank is not kept: the last round is made again.
  audit_ = saved.audit;
  audit_.done = false;
}

std::int64_t Atlas::projections() const {
  std::int64_t sum = 0;
  for (const Worker& worker : workers_) sum += worker.expander->projections();
  return sum;
}

std::int64_t Atlas::bytes() const {
  std::int64_t sum = charts_.bytes() + front_.bytes();
  for (const Worker& worker : workers_) sum += worker.expander->polytope_bytes() + worker.expander->list_bytes();
  return sum;
}

void Atlas::expand(std::int64_t chart_limit, double seconds) {
  window_.open(chart_limit, deadline_after(seconds));
  try {
    run_on_threads(threads(), [this](int worker) { work(worker); });
  } catch (...) {
    front_.settle();
    throw;
  }
  front_.settle();
}

// What one thread does in a call of expand.
void Atlas::work(int worker) {
  Expander& expander = *workers_[static_cast<std::size_t>(worker)].expander;
  try {
    while (TaskWindow::Task* const task = window_.take(worker > 0)) {
      int made = task->expansion.made;
      bool done = false;
      try {
        const ChartKey key = Front::first_key(task->expansion.number);
        done = expander.expand(front_.slot_of(task->expansion), key, task->most, made, window_.deadline());
      } catch (...) {
        window_.finish(*task, made, false, expander.take_reopened());
        throw;
      }
      window_.finish(*task, made, done, expander.take_reopened());
    }
  } catch (...) {
    window_.close();
    throw;
  }
}

std::vector<Auditor*> Atlas::auditors() {
  std::vector<Auditor*> out;
  for (Worker& worker : workers_) {
    if (!worker.auditor)
      worker.auditor = std::make_unique<Auditor>(worker.system ? *worker.system : system_, options_, charts_);
    out.push_back(worker.auditor.get());
  }
  return out;
}

void Atlas::audit(std::int64_t points, double seconds) {
  if (!complete() || audit_.done) return;
  const Clock::time_point start = Clock::now();
  if (!round_) round_ = std::make_unique<AuditRound>(charts_, front_, audit_, points);
  if (round_->run(auditors(), seconds - seconds_since(start))) end_round();
}

// What walks have found covered stays so: they are made again only when one of them found a hole.
void Atlas::end_round() {
  round_->apply(charts_);
  const std::int64_t charts = count();
  const bool found = begin_charts_at_holes();
  if (audit_.points == 0 && !round_->walks_found_holes()) audit_.points = round_->points();
  round_.reset();
  audit_.done = !found || audit_.rounds >= kMostRounds;
  if (found && audit_.done) audit_.points = 0;
  if (audit_.done) return;
  ++audit_.rounds;
  audit_.new_first = charts;
}

// At the holes that were found, but for those that a chart of another covers by now.
bool Atlas::begin_charts_at_holes() {
  Worker& worker = workers_.front();
  bool found = false;
  for (const Hole* hole : round_->holes()) {
    if (found && worker.auditor->covers(hole->x.data(), hole->Phi.data())) continue;
    found = true;
    worker.expander->start_at(hole->x.data(), hole->Phi.data(), Front::first_key(front_.new_number()));
    ++audit_.holes;
  }
  front_.defer(worker.expander->take_reopened());
  front_.settle();
  return found;
}

Checkpoint Atlas::save(std::int64_t first) const {
  const int x_size = system_.configuration_size(), k = system_.dimension(), basis_size = k * system_.tangent_size();
  Checkpoint out;
  const auto charts = static_cast<std::size_t>(std::max<std::int64_t>(count() - first, 0));
  out.centers.reserve(charts * static_cast<std::size_t>(x_size));
  out.bases.reserve(charts * static_cast<std::size_t>(basis_size));
  out.residuals.reserve(charts);
  out.regularities.reserve(charts);
  out.keys.reserve(charts);
  for (std::int64_t i = first; i < count(); ++i) {
    out.centers.insert(out.centers.end(), center(i), center(i) + x_size);
    out.bases.insert(out.bases.end(), basis(i), basis(i) + basis_size);
    out.residuals.push_back(chart(i).residual);
    out.regularities.push_back(chart(i).regularity);
    out.keys.push_back(chart(i).key);
  }
  for (std::int64_t i = 0; i < count(); ++i) {
    if (!chart(i).closed) continue;
    const Polytope& polytope = chart(i).polytope;
    for (int v = 0; v < polytope.vertex_count(); ++v) {
      if (polytope.state(v) == 0) continue;
      out.closed_charts.push_back(static_cast<std::int32_t>(i));
      out.closed_vertices.insert(out.closed_vertices.end(), polytope.vertex(v), polytope.vertex(v) + k);
      out.closed_reasons.push_back(polytope.state(v));
    }
  }
  front_.save(out);
  out.audit = audit_;
  return out;
}

// Charts that are put back in their order cut each other as they did. A slot is a chart's number then.
void Atlas::put_back_charts(const Checkpoint& saved) {
  const int x_size = system_.configuration_size(), basis_size = system_.dimension() * system_.tangent_size();
  for (std::size_t i = 0; i < saved.keys.size(); ++i) {
    const double* center = &saved.centers[i * static_cast<std::size_t>(x_size)];
    system_.check_point(center);
    workers_.front().expander->put_back(center, &saved.bases[i * static_cast<std::size_t>(basis_size)],
                                        saved.residuals[i], saved.regularities[i], saved.keys[i]);
    charts_[static_cast<int>(i)].done = true;
  }
}

void Atlas::put_back_closed_vertices(const Checkpoint& saved) {
  const int k = system_.dimension();
  Polytope::Scratch scratch;
  for (std::size_t i = 0; i < saved.closed_charts.size(); ++i) {
    Chart& chart = charts_[saved.closed_charts[i]];
    const double* u = &saved.closed_vertices[i * static_cast<std::size_t>(k)];
    if (!chart.closed) chart.polytope.list_outer(options_.radius, scratch);
    int v = 0;
    while (v < chart.polytope.vertex_count() && !std::equal(u, u + k, chart.polytope.vertex(v))) ++v;
    if (v == chart.polytope.vertex_count()) throw Error("the checkpoint is damaged, or of another version");
    chart.polytope.close(v, saved.closed_reasons[i]);
    chart.closed = true;
  }
}

}  // namespace graspatlas

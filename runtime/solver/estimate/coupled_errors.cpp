#include "runtime/solver/estimate/coupled_errors.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <type_traits>

#include "runtime/points/id_index.h"
#include "runtime/points/state_archive.h"
#include "runtime/solver/constraints/constraint.h"

namespace rapid {
namespace {

template <class T>
bool same(const T& a, const T& b)
{
    return std::memcmp(&a, &b, sizeof(T)) == 0;
}

}  // namespace

bool CoupledErrors::is_due(std::int64_t frame)
{
    return frame % stride == 0 || std::has_single_bit(static_cast<std::uint64_t>(frame));
}

void CoupledErrors::begin(const PointSet& points, const Dynamics& dynamics, const SolveOptions& options)
{
    if (unknown_.empty() && points.size() > max_points) {
        unknown_ = "the sum since birth, as more than 1,000 points act on one another";
        stop();
    }
    if (unknown_.empty()) {
        if (!runs_) start(options);
    } else if (options.begins_frame) {
        stop();
        if (is_due(++frames_)) start(options);
    }
    if (!runs_) return;

    if (!make_twins(dynamics)) return stop();
    set_ = points;
    ids_ = points.id();
    apply_differences(points);
    take_attributes(points);
    solved_ = shadows_ = PointSet();  // releases shared columns before the run writes them
    options_ = options;
    options_.substeps *= 2;
    options_.sinks = {};
    options_.interacts = !dynamics.interactions().empty();
    options_.loads = &loads_;
    options_.sleep_records = &sleep_records_;
}

CoupledErrors::Errors CoupledErrors::end(const PointSet& solved)
{
    Errors errors;
    if (runs_) try {
            solve(set_, dynamics_, options_);
            (unknown_.empty() ? errors.since_birth : errors.of_frame) = compare(solved, errors.ids);
        } catch (const Error& error) {
            unknown_ = fmt::format("the sum since birth, as twice the sub-steps end in an error: {}", error.message());
            stop();
        }
    set_ = {};
    dynamics_.clear();
    errors.unknown = unknown_;
    return errors;
}

// The shadows start at the positions of the points, with the run's memory.
void CoupledErrors::start(const SolveOptions& options)
{
    runs_ = true;
    if (options.loads) loads_ = *options.loads;
    if (options.sleep_records) sleep_records_ = *options.sleep_records;
}

void CoupledErrors::stop()
{
    runs_ = false;
    solved_ = shadows_ = PointSet();
    ids_ = Column<std::int64_t>();
    differences_.clear();
    twins_.clear();
    memories_.clear();
    loads_ = {};
    sleep_records_ = {};
}

// Applies changes of P and v by nodes since the last Solve to the shadows, as the same change.
void CoupledErrors::apply_differences(const PointSet& points)
{
    const IdIndex index(std::as_const(solved_).id());
    const Strided<std::int64_t> id = points.id().read();
    const Strided<Vec3f> P = points.P().read(), v = points.v().read();
    const std::span<Vec3f> shadow_P = set_.P().write(), shadow_v = set_.v().write();
    std::vector<Difference> differences(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        const std::uint32_t before = index[id[i]];
        if (before == IdIndex::none) continue;
        const Difference& difference = differences[i] = differences_[before];
        shadow_P[i] = (P[i].cast<double>() + difference.P).cast<float>();
        shadow_v[i] = (v[i].cast<double>() + difference.v).cast<float>();
    }
    differences_ = std::move(differences);
}

// Attributes that no node has changed since the last Solve keep the shadows' values: how long they have been still,
// how they turn, values written by actions.
void CoupledErrors::take_attributes(const PointSet& points)
{
    const IdIndex before(std::as_const(solved_).id()), shadow(std::as_const(shadows_).id());
    const Strided<std::int64_t> id = points.id().read();
    for (const auto& [name, any] : points.columns()) {
        if (name == "P" || name == "v" || name == "id" || name == "dt") continue;
        std::visit(
            [&, &name = name](const auto& column) {
                using C = std::decay_t<decltype(column)>;
                const AnyColumn* was = std::as_const(solved_).find(name);
                const AnyColumn* left = std::as_const(shadows_).find(name);
                const C *from = was ? std::get_if<C>(was) : nullptr, *to = left ? std::get_if<C>(left) : nullptr;
                if (!from || !to || (!from->is_uniform() && from->shares_values_with(*to))) return;
                if (from->is_uniform() && to->is_uniform() && same((*from)[0], (*to)[0])) return;
                const auto own = std::get<C>(*set_.find(name)).write();
                for (std::size_t i = 0; i < points.size(); ++i) {
                    const std::uint32_t b = before[id[i]], k = shadow[id[i]];
                    if (b != IdIndex::none && k != IdIndex::none && same(column[i], (*from)[b])) own[i] = (*to)[k];
                }
            },
            any);
    }
}

// Returns false if a constraint has no twin.
bool CoupledErrors::make_twins(const Dynamics& dynamics)
{
    const std::vector<std::shared_ptr<const Constraint>> before = std::exchange(twins_, {});
    dynamics.visit_in_order([&](const auto& dynamic) {
        if constexpr (std::is_same_v<std::decay_t<decltype(*dynamic)>, Constraint>) {
            const auto same = std::find_if(before.begin(), before.end(),
                                           [&](const auto& twin) { return twin->node == dynamic->node; });
            const std::shared_ptr<const Constraint> twin = dynamic->twin(same == before.end() ? nullptr : same->get());
            if (!twin) {
                unknown_ = fmt::format("all points, as the constraint \"{}\" has no twin", dynamic->node);
                return;
            }
            const auto saved = memories_.find(dynamic->node);
            const auto* remembering = dynamic_cast<const Remembering*>(twin.get());
            if (saved != memories_.end() && remembering) {
                StateReader reader(saved->second);
                remembering->load(reader);
                reader.finish();
            }
            twins_.push_back(twin);
            dynamics_.add(twin);
        } else {
            dynamics_.add(dynamic);
        }
    });
    memories_.clear();
    return twins_.size() == dynamics.constraints().size();
}

std::map<std::string, SavedState> CoupledErrors::memories_of_twins() const
{
    std::map<std::string, SavedState> memories = memories_;
    for (const auto& twin : twins_)
        if (const auto* remembering = dynamic_cast<const Remembering*>(twin.get())) {
            StateWriter writer;
            remembering->save(writer);
            memories[twin->node] = writer.take();
        }
    return memories;
}

// ids: of the compared points.
std::vector<double> CoupledErrors::compare(const PointSet& solved, std::vector<std::int64_t>& ids)
{
    const PointSet& shadows = set_;
    const IdIndex before(ids_), found(shadows.id());
    const Strided<std::int64_t> id = solved.id().read();
    const Strided<Vec3f> P = solved.P().read(), v = solved.v().read();
    const Strided<Vec3f> shadow_P = shadows.P().read(), shadow_v = shadows.v().read();
    std::vector<Difference> differences(solved.size());
    std::vector<double> errors;
    errors.reserve(solved.size());
    for (std::size_t i = 0; i < solved.size(); ++i) {
        const std::uint32_t k = found[id[i]];
        Difference& difference = differences[i];
        difference.is_known = k != IdIndex::none && differences_[before[id[i]]].is_known;
        if (!difference.is_known) continue;
        difference.P = shadow_P[k].cast<double>() - P[i].cast<double>();
        difference.v = shadow_v[k].cast<double>() - v[i].cast<double>();
        errors.push_back(2 * difference.P.norm());
        ids.push_back(id[i]);
    }
    differences_ = std::move(differences);
    solved_ = solved;
    shadows_ = set_;
    return errors;
}

}  // namespace rapid

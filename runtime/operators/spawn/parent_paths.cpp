#include "runtime/operators/spawn/parent_paths.h"

#include <algorithm>
#include <cmath>

#include "runtime/points/id_index.h"
#include "runtime/points/members.h"

namespace rapid {
namespace {

ParentPaths::Piece piece_between(const ParentPaths::Moment& from, const ParentPaths::Moment& to, double begin,
                                 double end)
{
    const double T = end - begin;
    const Vec3d none = Vec3d::Zero();
    if (!(T > 0)) return {begin, end, to.P, none, none, none, to.v};
    const Vec3d d = to.P - from.P;
    return {begin, end, from.P, T * from.v, 3 * d - T * (2 * from.v + to.v), T * (from.v + to.v) - 2 * d, to.v};
}

}  // namespace

ParentPaths::ParentPaths(const PointSet& living, const StepRecord& record, const std::string& group)
    : living_(living),
      record_(record),
      living_states_(living),
      killed_states_(record.killed),
      old_states_(record.old),
      before_(record.before)
{
    parents_.reserve(living.size() + record.killed.size() + record.old.size());
    add(living, {}, true, group);
    add(record.killed, record.killed_at, false, group);
    add(record.old, record.old_at, true, group);
    take_hits();
}

void ParentPaths::add(const PointSet& set, std::span<const double> died_at, bool moved_on, const std::string& group)
{
    if (set.empty()) return;
    const double start = record_.time - record_.h;
    const IdIndex index(record_.before.id());
    const Strided<std::int64_t> ids_before = record_.before.id().read(), ids = set.id().read();
    const Strided<std::uint8_t> members = members_of(set, group);
    const Column<float>* own = record_.before.find<float>("dt");
    const float h = static_cast<float>(record_.h);
    std::uint32_t next = 0;  // usually the points are in the same order
    for (std::size_t i = 0; i < set.size(); ++i) {
        std::uint32_t before = next;
        if (!(next < record_.before.size() && ids_before[next] == ids[i])) before = index[ids[i]];
        next = before == none ? next : before + 1;
        Parent parent{&set, static_cast<std::uint32_t>(i), ids[i], before, record_.h, record_.h, record_.h};
        if (before != none) {
            // The time of the whole step, in double precision.
            parent.begin = !own || (*own)[before] == h ? 0 : record_.h - double((*own)[before]);
        } else {
            ++without_path_;
        }
        if (!died_at.empty()) parent.end = std::clamp(died_at[i] - start, parent.begin, record_.h);
        if (!moved_on) parent.path_end = parent.end;
        parent.takes_part = members[i] != 0;
        parent.is_alive = died_at.empty();
        parent.is_new = ids[i] >= record_.first_new;
        parents_.push_back(parent);
    }
}

void ParentPaths::take_hits()
{
    if (record_.hits.empty()) return;
    std::vector<std::uint32_t> first(record_.before.size() + 1, 0);
    for (const LoggedHit& hit : record_.hits) ++first[hit.point + 1];
    for (std::size_t i = 0; i + 1 < first.size(); ++i) first[i + 1] += first[i];
    for (Parent& parent : parents_) {
        if (parent.before == none) continue;
        parent.hit = first[parent.before];
        parent.hits = first[parent.before + 1] - parent.hit;
    }
}

ParentPaths::Piece ParentPaths::piece(const Parent& parent, double t) const
{
    Moment to = states_of(parent).at(parent.index);
    if (parent.before == none) return piece_between(to, to, parent.end, parent.end);
    Moment from = before_.at(parent.before);
    double begin = parent.begin, end = parent.path_end;
    for (std::uint32_t k = 0; k < parent.hits; ++k) {
        const LoggedHit& hit = record_.hits[parent.hit + k];
        const double when = time_of(hit);
        if (when > t) {
            to = {hit.P.cast<double>(), hit.v0.cast<double>()};
            end = when;
            break;
        }
        from = {hit.P.cast<double>(), hit.v1.cast<double>()};
        begin = when;
    }
    return piece_between(from, to, begin, end);
}

}  // namespace rapid

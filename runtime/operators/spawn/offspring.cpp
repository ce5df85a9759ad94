#include "runtime/operators/spawn/offspring.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>

#include "runtime/base/parallel.h"
#include "runtime/operators/births/draws.h"

namespace rapid {
namespace {

// Returns the number of a birth among all births of all parents, for its random numbers.
std::uint64_t number_of(std::int64_t parent, std::uint64_t number)
{
    return (static_cast<std::uint64_t>(parent) << 32) + number;
}

}  // namespace

// The newborn points' part of the columns, shape [n]; empty if nothing reads them.
struct Offspring::Columns {
    std::span<Vec3f> P, v;
    std::span<std::int64_t> id, parent;
    std::span<float> dt, birthtime, life;
    std::vector<DrawValues> drawn;
    // Each copies an attribute of a parent to the births from `first` on.
    std::vector<std::function<void(const Children& children, std::size_t first, std::size_t count)>> inherit;
};

Offspring::Offspring(const ParentPaths& parents, const std::vector<Children>& all_children, const Traits& traits,
                     const Evaluation& now)
    : parents_(parents), all_children_(all_children), traits_(traits), newborn_(traits.newborn), now_(now)
{
}

void Offspring::make_columns(PointSet& points) const
{
    for (const AttributeSpec& spec : newborn_.given())
        if (now_.keeps(spec.name)) points.add(spec);
    if (newborn_.joins_group(now_)) points.group(newborn_.joins);
    if (!now_.at_start) points.add({"dt", static_cast<float>(now_.frame.dt)});
}

std::size_t Offspring::append_to(PointSet& points, std::int64_t& next_id, std::size_t most) const
{
    const std::size_t all = all_children_.empty() ? 0 : all_children_.back().first + all_children_.back().count;
    const std::size_t n = std::min(all, most);
    if (n == 0) return 0;
    std::vector<AttributeSpec> common = {{"age", 0.0f}};
    for (const auto& [name, value] : newborn_.attributes.of) common.push_back({name, value.first()});
    if (newborn_.life && newborn_.life->is_single()) common.push_back({"life", static_cast<float>(newborn_.life->min)});
    points.append(n, common, newborn_.joins_group(now_) ? std::vector{newborn_.joins} : std::vector<std::string>());

    const Columns columns = columns_of(points, n);
    for_each_chunk(n, [&](std::size_t begin, std::size_t end) { fill(columns, begin, end); });
    std::iota(columns.id.begin(), columns.id.end(), next_id);
    next_id += static_cast<std::int64_t>(n);
    return n;
}

Offspring::Columns Offspring::columns_of(PointSet& points, std::size_t n) const
{
    const auto last = [&]<class T>(const char* name, T) {
        Column<T>* column = points.find<T>(name);
        return column ? column->write().last(n) : std::span<T>();
    };
    Columns columns;
    columns.P = points.P().write().last(n);
    columns.v = points.v().write().last(n);
    columns.id = points.id().write().last(n);
    columns.parent = last("parent", std::int64_t{});
    columns.dt = last("dt", 0.0f);
    columns.birthtime = last("birthtime", 0.0f);
    if (newborn_.life && !newborn_.life->is_single()) columns.life = last("life", 0.0f);
    columns.drawn = newborn_.draws_of(points, n, now_);
    add_inherited(points, n, columns);
    return columns;
}

// mass and pscale of children that split their parent: m / n, r / n^(1/3).
void Offspring::add_inherited(PointSet& points, std::size_t n, Columns& columns) const
{
    for (const std::string& name : traits_.inherit) {
        if (!now_.keeps(name)) continue;
        AnyColumn* own = points.find(name);
        if (!own) continue;
        std::visit(
            [&]<class T>(Column<T>& column) {
                const std::span<T> to = column.write().last(n);
                const bool is_mass = traits_.splits && name == "mass", is_radius = traits_.splits && name == "pscale";
                const T fallback = column.fallback();
                columns.inherit.push_back([=, this](const Children& children, std::size_t first, std::size_t count) {
                    const ParentPaths::Parent& parent = parents_[children.parent];
                    const Column<T>* from = parent.set->find<T>(name);
                    T value = from ? (*from)[parent.index] : fallback;
                    if constexpr (std::is_same_v<T, float>) {
                        if (is_mass) value = value / static_cast<float>(children.count);
                        if (is_radius) value = value / std::cbrt(static_cast<float>(children.count));
                    }
                    std::fill_n(to.begin() + static_cast<std::ptrdiff_t>(first), count, value);
                });
            },
            *own);
    }
}

// Fills the births [begin, end) of the step, parent by parent.
void Offspring::fill(const Columns& columns, std::size_t begin, std::size_t end) const
{
    const Cone cone(newborn_.spread);
    const StepRecord& record = parents_.record();
    const bool turns = newborn_.spread > 0 && (!is_zero(newborn_.speed) || newborn_.velocity != Vec3d::Zero());
    auto children = std::upper_bound(all_children_.begin(), all_children_.end(), begin,
                                     [](std::size_t i, const Children& b) { return i < b.first; }) -
                    1;
    std::array<Draws, 64> draws;
    std::array<Vec3d, 64> own, of_parent;  // m/s
    for (std::size_t i = begin; i < end;) {
        if (i >= children->first + children->count) ++children;
        const std::size_t k = i - children->first;
        const std::size_t count = std::min({children->count - k, end - i, draws.size()});
        const std::int64_t parent = parents_.id(parents_[children->parent]);
        const std::uint64_t number = number_of(parent, children->number + k);
        uniform4(now_.random, number, draw_use, std::span(draws).first(count));
        for (const auto& inherit : columns.inherit) inherit(*children, i, count);
        for (const DrawValues& draw : columns.drawn) draw(i, count, number);
        const ParentPaths::Parent& of = parents_[children->parent];
        ParentPaths::Piece piece = parents_.piece(of, children->begin);
        for (std::size_t j = 0; j < count; ++j) {
            double t = children->begin;
            if (children->spacing > 0)
                t += (static_cast<double>(k + j + 1) - children->due) * children->spacing;
            else if (children->end > children->begin)
                t += draws[j][age_draw] * (children->end - children->begin);
            t = std::min(t, children->end);
            if (!piece.holds(t)) piece = parents_.piece(of, t);
            const ParentPaths::Moment moment =
                children->hit == Children::no_hit ? piece.at(t) : moment_of_hit(children->hit);
            of_parent[j] = moment.v;
            own[j] = newborn_.velocity;
            if (!is_zero(newborn_.speed)) own[j] += speed_of(number + j) * normal_of(*children, moment.v);
            columns.P[i + j] = moment.P.cast<float>();
            const double L = record.h - t + traits_.wait;
            if (!columns.dt.empty()) columns.dt[i + j] = static_cast<float>(L);
            if (!columns.birthtime.empty()) columns.birthtime[i + j] = static_cast<float>(now_.frame.time - L);
            if (!columns.life.empty()) columns.life[i + j] = static_cast<float>(newborn_.life->at(draws[j][life_draw]));
            if (!columns.parent.empty()) columns.parent[i + j] = parent;
        }
        if (turns) cone.turn(std::span(own).first(count), draws);
        for (std::size_t j = 0; j < count; ++j)
            columns.v[i + j] = (own[j] + traits_.share * of_parent[j]).cast<float>();
        i += count;
    }
}

double Offspring::speed_of(std::uint64_t number) const
{
    return newborn_.speed.is_single() ? newborn_.speed.min
                                      : newborn_.speed.at(uniform4(now_.random, number, speed_use)[0]);
}

ParentPaths::Moment Offspring::moment_of_hit(std::uint32_t index) const
{
    const LoggedHit& hit = parents_.record().hits[index];
    return {hit.P.cast<double>(), hit.v1.cast<double>()};
}

// Returns the direction of `speed`: the surface normal at a hit, the parent's attribute N, or its direction of motion.
Vec3d Offspring::normal_of(const Children& children, const Vec3d& v) const
{
    if (children.hit != Children::no_hit) return parents_.record().hits[children.hit].n.cast<double>();
    const ParentPaths::Parent& parent = parents_[children.parent];
    const Column<Vec3f>* normals = parent.set->find<Vec3f>("N");
    const Vec3d along = normals ? Vec3d((*normals)[parent.index].cast<double>()) : v;
    const double length = along.norm();
    return length > 0 ? Vec3d(along / length) : Vec3d(Vec3d::UnitY());
}

}  // namespace rapid

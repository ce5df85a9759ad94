#include "runtime/operators/spawn/offspring.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <numeric>
#include <regex>

#include "runtime/base/parallel.h"
#include "runtime/operators/births/draws.h"
#include "runtime/operators/births/newborn.h"
#include "runtime/points/id_index.h"

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

namespace {

constexpr double max_births_of_parent = 4294967295;  // births: their numbers are half of a counter

double whole_births(double due) { return std::floor(due + whole_tolerance); }

std::optional<AttributeComparison> comparison_of(const std::string& text)
{
    static const std::regex form(R"(\s*([A-Za-z_]\w*)(?:\.([xyz]))?\s*(<=|>=|<|>)\s*([-+.\w]+)\s*)");
    std::smatch part;
    if (!std::regex_match(text, part, form)) return std::nullopt;
    AttributeComparison comparison;
    comparison.attribute = part[1];
    if (part[2].matched) comparison.axis = *part[2].first - 'x';
    comparison.relation = part[3] == "<"    ? AttributeComparison::Below
                          : part[3] == "<=" ? AttributeComparison::AtMost
                          : part[3] == ">"  ? AttributeComparison::Above
                                            : AttributeComparison::AtLeast;
    const std::string number = part[4];
    char* end = nullptr;
    comparison.limit = std::strtod(number.c_str(), &end);
    if (*end != '\0' || !std::isfinite(comparison.limit)) return std::nullopt;
    return comparison;
}

// The compared value of a parent at a time in the step: P and v along its path, other values interpolated between
// those before and after.
class ComparedValue {
public:
    ComparedValue(const ParentPaths& paths, const AttributeComparison& comparison)
        : paths_(paths), comparison_(comparison)
    {
    }

    double at(const ParentPaths::Parent& parent, double t) const
    {
        if (comparison_.attribute == "P") return component(paths_.at(parent, t).P);
        if (comparison_.attribute == "v") return component(paths_.at(parent, t).v);
        const double after = value(*parent.set, parent.index), T = parent.path_end - parent.begin;
        const bool starts_here = parent.before != ParentPaths::none;
        if (!starts_here || !(T > 0)) return after;
        const double before = value(paths_.record().before, parent.before);
        return before + (after - before) * std::clamp((t - parent.begin) / T, 0.0, 1.0);
    }

    // Returns the first time at which it holds, to rounding; it does not hold at the beginning, and does at the end.
    double first_moment(const ParentPaths::Parent& parent) const
    {
        double low = parent.begin, high = parent.end;
        for (int i = 0; i < 50 && low < high; ++i) {
            const double middle = 0.5 * (low + high);
            (comparison_.holds(at(parent, middle)) ? high : low) = middle;
        }
        return high;
    }

private:
    double component(const Vec3d& v) const
    {
        if (comparison_.axis < 0)
            throw Error(fmt::format("on: \"{0}\" is a vec3; compare {0}.x, {0}.y or {0}.z", comparison_.attribute));
        return v[comparison_.axis];
    }

    double value(const PointSet& set, std::size_t i) const
    {
        const AnyColumn* column = set.find(comparison_.attribute);
        if (!column) throw Error(fmt::format("on: the parents have no attribute \"{}\"", comparison_.attribute));
        return std::visit(
            [&]<class T>(const Column<T>& c) -> double {
                if constexpr (std::is_same_v<T, Vec3f>)
                    return component(c[i].template cast<double>());
                else if constexpr (std::is_same_v<T, Quatf>)
                    throw Error(
                        fmt::format("on: \"{}\" is a quaternion, which can't be compared", comparison_.attribute));
                else if constexpr (std::is_same_v<T, Token>)
                    throw Error(fmt::format(
                        "on: \"{0}\" is a string; compare it in a function: on = function(p) return p.{0} == \"a\" end",
                        comparison_.attribute));
                else if (comparison_.axis >= 0)
                    throw Error(fmt::format("on: \"{}\" is a number and has no components", comparison_.attribute));
                else
                    return static_cast<double>(c[i]);
            },
            *column);
    }

    const ParentPaths& paths_;
    const AttributeComparison& comparison_;
};

std::vector<std::uint8_t> tested(const PointFunction& function, const PointSet& points, const Evaluation& now)
{
    std::vector<std::uint8_t> result(points.size(), 1);
    if (points.empty()) return result;
    const std::unique_ptr<PointTest> test = function.test_of(points, now);
    test->begin(true);
    for_each_chunk(
        points.size(),
        [&](std::size_t begin, std::size_t end) { test->test(begin, std::span(result).subspan(begin, end - begin)); },
        test->chunk());
    return result;
}

// Returns the values of a float or integer attribute. Throws Error if there is none of that name, or it holds vectors.
std::vector<double> numbers_of(const PointSet& points, const std::string& attribute)
{
    const AnyColumn* column = points.find(attribute);
    if (!column)
        throw Error(fmt::format("rapid.attr \"{}\": the parents have no attribute with this name{}", attribute,
                                did_you_mean(attribute, points.column_names())));
    return std::visit(
        [&]<class T>(const Column<T>& c) {
            std::vector<double> values(points.size());
            if constexpr (std::is_arithmetic_v<T>)
                for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<double>(c[i]);
            else
                throw Error(fmt::format("rapid.attr \"{}\" is {}; it must be a number", attribute,
                                        type_name(type_of(*column))));
            return values;
        },
        *column);
}

// The amount of each parent, looked up once per set.
class Amounts {
public:
    template <class T>
    Amounts(const Amount<T>& amount, const ParentPaths& paths)
        : what_(std::is_same_v<T, int> ? "count" : "rate"), attribute_(amount.attribute), value_(amount.value)
    {
        if (attribute_.empty()) return;
        const StepRecord& record = paths.record();
        for (const PointSet* set : {&paths.living(), &record.killed, &record.old})
            if (!set->empty()) of_set_.emplace_back(set, numbers_of(*set, attribute_));
    }

    double of(const ParentPaths::Parent& parent, std::int64_t id) const
    {
        if (attribute_.empty()) return value_;
        for (const auto& [set, values] : of_set_) {
            if (set != parent.set) continue;
            const double value = values[parent.index];
            if (value >= 0 && value <= max_births_of_parent) return value;
            throw Error(fmt::format("{} = rapid.attr \"{}\": parent {} has {:g}; it must be at least 0", what_,
                                    attribute_, id, value));
        }
        return 0;
    }

private:
    const char* what_;
    const std::string attribute_;
    const double value_;
    std::vector<std::pair<const PointSet*, std::vector<double>>> of_set_;
};

}  // namespace

void BirthEvent::uses(Uses& uses) const
{
    if (kind == Compares) uses.reads_of_source.push_back(comparison.attribute);
    if (kind != Tests) return;
    Uses own;
    test->uses(own);
    const auto append = [](std::vector<std::string>& to, const std::vector<std::string>& from) {
        to.insert(to.end(), from.begin(), from.end());
    };
    append(uses.reads_of_source, own.reads);
    append(uses.takes_of_source, own.may);
    append(uses.reads_groups_of_source, own.reads_groups);
}

void read_value(const Param& param, const Value& value, BirthEvent& field)
{
    field = {};
    if (const auto test = value.object<PointFunction>()) {
        field.kind = BirthEvent::Tests;
        field.test = test;
        return;
    }
    const std::string* text = value.get<std::string>();
    if (text && (*text == "hit" || *text == "death" || *text == "birth")) {
        field.kind = *text == "hit" ? BirthEvent::Hit : *text == "death" ? BirthEvent::Death : BirthEvent::Birth;
        return;
    }
    const std::optional<AttributeComparison> comparison = text ? comparison_of(*text) : std::nullopt;
    if (!comparison)
        throw Error(
            fmt::format("{} = {} is not an event; it must be \"hit\", \"death\", \"birth\", a comparison of an "
                        "attribute with a number (\"age > 0.5\", \"P.y < 0\"), or a function of a point",
                        param.name, describe(value)));
    field.kind = BirthEvent::Compares;
    field.comparison = *comparison;
}

// Collects the births of a step.
class ParentClock::Tally {
public:
    Tally(const ParentPaths& parents, const BirthPlan& plan, const Evaluation& now)
        : parents_(parents), plan_(plan), random_(now.random)
    {
        if (plan.rate) rates_.emplace(*plan.rate, parents);
        if (plan.count) counts_.emplace(*plan.count, parents);
        if (!plan.on) return;
        if (plan.on->kind == BirthEvent::Tests) holds_ = tested(*plan.on->test, parents.living(), now);
        if (plan.on->kind == BirthEvent::Compares) value_.emplace(parents, plan.on->comparison);
    }

    void take(std::uint32_t i, State& state)
    {
        const ParentPaths::Parent& parent = parents_[i];
        if (!parent.takes_part) return;
        if (plan_.on)
            take_events(i, parent, state);
        else
            take_stream(i, parent, state);
    }

    std::vector<Children> all_children;

private:
    void take_stream(std::uint32_t i, const ParentPaths::Parent& parent, State& state)
    {
        Children children{};
        children.begin = plan_.birth == "end" ? parent.end : parent.begin;
        children.end = plan_.birth == "begin" ? parent.begin : parent.end;
        const std::int64_t id = parents_.id(parent);
        const bool even = plan_.birth == "even";
        const double T = parent.end - parent.begin;
        if (counts_) {
            const double of_frame = parents_.record().h > 0 ? std::floor(counts_->of(parent, id)) : 0;
            const double births =
                std::floor(of_frame * (plan_.part + 1) / plan_.parts) - std::floor(of_frame * plan_.part / plan_.parts);
            if (even && births > 0) children.spacing = T / births;
            return add(i, state, births, children);
        }
        const double rate = rates_->of(parent, id);
        // Parents that are born together do not emit simultaneously, unless births are even.
        if (!state.is_known && !even) state.due = uniform4(random_, static_cast<std::uint64_t>(id), phase_use)[0];
        state.is_known = true;
        const double due = state.due + rate * T, births = whole_births(due);
        if (even && rate > 0) children.spacing = 1 / rate, children.due = state.due;
        state.due = std::max(0.0, due - births);
        add(i, state, births, children);
    }

    void take_events(std::uint32_t i, const ParentPaths::Parent& parent, State& state)
    {
        switch (plan_.on->kind) {
            case BirthEvent::Hit:
                for (std::uint32_t k = parent.hit; k < parent.hit + parent.hits; ++k) {
                    const LoggedHit& hit = parents_.record().hits[k];
                    const double t = parents_.time_of(hit);
                    if (hit.speed >= plan_.min_speed && t <= parent.end) add_at(i, state, t, k);
                }
                break;
            case BirthEvent::Death:
                if (!parent.is_alive) add_at(i, state, parent.end);
                break;
            case BirthEvent::Birth:
                if (parent.is_new) add_at(i, state, parent.begin);
                break;
            case BirthEvent::Compares:
                take_comparison(i, parent, state);
                break;
            case BirthEvent::Tests: {
                const bool holds = parent.is_alive && holds_[parent.index];
                if (holds && !state.held) add_at(i, state, parent.end);
                state.held = holds;
            }
        }
    }

    // The number of contacts grows at contacts, each of which is an event with a normal.
    void take_contacts(std::uint32_t i, const ParentPaths::Parent& parent, State& state)
    {
        const AttributeComparison& comparison = plan_.on->comparison;
        double total = value_->at(parent, parent.begin);
        if (comparison.holds(total) && !state.held) add_at(i, state, parent.begin);
        for (std::uint32_t k = parent.hit; k < parent.hit + parent.hits; ++k) {
            const LoggedHit& hit = parents_.record().hits[k];
            const double t = parents_.time_of(hit);
            if (!hit.recorded || t > parent.end) continue;
            const bool before = comparison.holds(total);
            if (comparison.holds(++total) && !before) add_at(i, state, t, k);
        }
        state.held = comparison.holds(total);
    }

    void take_comparison(std::uint32_t i, const ParentPaths::Parent& parent, State& state)
    {
        if (plan_.on->comparison.attribute == "hittotal" && parents_.record().has_contacts)
            return take_contacts(i, parent, state);
        const bool first = plan_.on->comparison.holds(value_->at(parent, parent.begin));
        const bool last = plan_.on->comparison.holds(value_->at(parent, parent.end));
        if (first && !state.held)
            add_at(i, state, parent.begin);
        else if (!first && last)
            add_at(i, state, value_->first_moment(parent));
        state.held = last;
    }

    void add_at(std::uint32_t i, State& state, double t, std::uint32_t hit = Children::no_hit)
    {
        const ParentPaths::Parent& parent = parents_[i];
        Children children{};
        children.hit = hit;
        children.begin = children.end = t;
        add(i, state, counts_ ? std::floor(counts_->of(parent, parents_.id(parent))) : 1, children);
    }

    void add(std::uint32_t i, State& state, double births, Children children)
    {
        if (plan_.limit) births = std::min(births, *plan_.limit - std::min(*plan_.limit, double(state.born)));
        births = std::min(births, max_births_of_parent - double(state.born));
        if (!(births >= 1)) return;
        children.parent = i;
        children.number = state.born;
        children.first = total_;
        children.count = static_cast<std::size_t>(births);
        total_ += children.count;
        state.born += children.count;
        all_children.push_back(children);
    }

    const ParentPaths& parents_;
    const BirthPlan& plan_;
    const RandomKey random_;
    std::optional<Amounts> rates_, counts_;
    std::optional<ComparedValue> value_;
    std::vector<std::uint8_t> holds_;  // of the living points, by the test
    std::size_t total_ = 0;
};

std::vector<Children> ParentClock::births(const ParentPaths& parents, const BirthPlan& plan, const Evaluation& now)
{
    Tally tally(parents, plan, now);
    const IdIndex known(ids_);
    std::vector<State> states;
    states.reserve(parents.living().size());
    std::size_t next = 0;  // usually the points are in the order of the last step
    for (std::uint32_t i = 0; i < parents.size(); ++i) {
        const std::int64_t id = parents.id(parents[i]);
        State state;
        if (next < states_.size() && std::as_const(ids_)[next] == id)
            state = states_[next++];
        else if (const std::uint32_t index = known[id]; index != IdIndex::none)
            state = states_[index], next = index + 1;
        tally.take(i, state);
        if (parents[i].is_alive) states.push_back(state);
    }
    ids_ = parents.living().id();
    states_ = std::move(states);
    return std::move(tally.all_children);
}

}  // namespace rapid

// emit: emits points from a surface, from a volume or at points, which may be at rest, moving or deforming (paper §3).
//
// A newborn point is appended with its state at birth. With the age L at the end of its first frame
// (emit/birth_times.h), its column `dt` holds γ = min(L, h), the time for which Solve advances it in this frame, and
// its age is L - γ, so that it reaches L at the frame's end.
//
// A moving source emits each point from where its birthplace is at the time of birth, t = 1 - L / h of the path from
// the previous frame (shapes/motion/body_path.h); emit/birth_velocity.h has the equation of the velocity.
//
// A birth's random numbers depend on the seed, on the name of this node and on the birth's number in this emitter.
// Births outside a subset of the points (points/subset.h) count and take an id, but nothing else is computed for them.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "runtime/base/memory_budget.h"
#include "runtime/base/parallel.h"
#include "runtime/graph/coupling.h"
#include "runtime/graph/error_sources.h"
#include "runtime/graph/node_type.h"
#include "runtime/graph/param.h"
#include "runtime/graph/stateful.h"
#include "runtime/operators/births/newborn.h"
#include "runtime/operators/emit/birth_source.h"
#include "runtime/operators/emit/birth_times.h"
#include "runtime/operators/emit/birth_velocity.h"
#include "runtime/points/attribute_like.h"

namespace rapid {
namespace {

constexpr std::size_t batch_size = 256;    // births processed together, in the first-level cache
constexpr double max_births = 2147483647;  // in a frame

// The newborn points' part of the columns with individual values, shape [n]; other columns are empty.
struct NewbornColumns {
    std::span<Vec3f> P, v;
    std::span<std::int64_t> id;
    std::span<float> dt, age, birthtime, life;
    // Copy inherited attributes to the newborn from number `first` on.
    std::vector<std::function<void(std::size_t first, std::span<const Birthplace> birthplaces)>> inherit;
    // Draw the values that differ between births.
    std::vector<DrawValues> draw;
};

// Returns the values of all points, one per point; expanded in parallel, because all points are many more than the
// newborn ones.
std::span<float> expanded(Column<float>& column)
{
    if (!column.is_uniform()) return column.write();
    const float shared = column[0];
    const std::span<float> values = column.overwrite();
    for_each_chunk(values.size(), [&](std::size_t begin, std::size_t end) {
        std::fill(values.begin() + static_cast<std::ptrdiff_t>(begin),
                  values.begin() + static_cast<std::ptrdiff_t>(end), shared);
    });
    return values;
}

// A source, which may be given as a position.
struct EmitSource {
    static constexpr std::string_view param_type = "mesh, level set, shape, fog, curve, points or vec3";

    ObjectPtr object;
};

void read_value(const Param& param, const Value& value, EmitSource& field)
{
    const Table* list = value.table();
    if (!value.get<Vec3d>() && !(list && list->list.size() == 3 && list->list.front().get<double>())) {
        rapid::read_value(param, value, field.object);
        if (const auto moving = in_motion<AnimatedMesh>(field.object)) field.object = moving;
        return;
    }
    Vec3f position;
    rapid::read_value(param, value, position);
    auto points = std::make_shared<PointsObject>();
    points->points.append(1);
    points->points.P().write()[0] = position;
    field.object = std::move(points);
}

struct Emit : Newborn {
    EmitSource source;
    std::string from, density, source_group;
    std::optional<double> rate;
    std::optional<int> count;
    std::optional<std::map<std::int64_t, double>> impulse;
    std::optional<BirthAge> age;
    std::string motion;
    double alpha, inherit_velocity;
    std::optional<FrameSet> cut;

    static NodeType declare()
    {
        auto type = node<Emit>("emit", "Emits points from a surface, a volume, a curve or points.");
        declare_source(type);
        type.param(&Emit::rate, "rate", Value(), at_least(0), "1/s", "births per second")
            .param(&Emit::count, "count", Value(), at_least(0), "", "births per frame")
            .param(&Emit::impulse, "impulse", Value(), between(0, max_births), "",
                   "births in single frames, {[frame] = count}; those of the first frame have not moved yet")
            .param(&Emit::age, "age", Value(), at_least(0), "s",
                   "age at the end of the frame of birth, instead of birth: a number, {min, max}, or an attribute of "
                   "the source");
        declare_newborn(type, "the source's normal N");
        return type;
    }

    static void declare_source(Declaration<Emit>& type)
    {
        type.param(&Emit::source, "source", Value(), any_number(), "", "object that emits the points")
            .required()
            .param(&Emit::from, "from", Value(), any_number(), "",
                   "part of the source that emits; the default is \"points\" for points, otherwise \"surface\" (the "
                   "points of a mesh are its vertices)")
            .choices({"surface", "volume", "points"})
            .param(&Emit::density, "density", Value(), any_number(), "",
                   "attribute of the source's points, or of a mesh's vertices or faces; births are distributed in "
                   "proportion to it")
            .param(&Emit::source_group, "source_group", Value(), any_number(), "",
                   "group of a mesh's faces; only these emit")
            .constant()
            .param(&Emit::motion, "motion", "spline", any_number(), "",
                   "path of a moving source within a frame: a cubic spline, a straight line, or none (at rest at the "
                   "frame's end)")
            .choices({"spline", "linear", "none"})
            .param(
                &Emit::alpha, "alpha", 0.5, any_number(), "",
                "tangents of the spline as a fraction of the path over two frames; 0.5 keeps a uniform motion uniform")
            .param(&Emit::cut, "cut", Value(), between(-max_births, max_births), "",
                   "frames to which the source jumps, without births in between; by default large jumps are detected "
                   "and reported")
            .param(&Emit::inherit_velocity, "inherit_velocity", 1.0, any_number(), "",
                   "fraction of the source's velocity that is added");
    }

    void uses(Uses& uses) const
    {
        for (const AttributeSpec& spec : made()) uses.makes.push_back(spec);
        const bool whole_frames = !age && birth.when == "begin";
        if (!whole_frames) uses.writes.push_back("dt");
        use_newborn(uses);
    }

    void take(const Subset& subset) { subset_ = subset; }

    std::optional<std::vector<float>> values(const std::string& attribute, float fallback) const
    {
        if (attributes.has(attribute)) return common_value(attribute);
        const auto* own = source_.values().find<float>(attribute);
        if (!own) return std::vector{fallback};
        return own->is_uniform() && own->size() > 0 ? std::optional(std::vector{(*own)[0]}) : std::nullopt;
    }

    void check() const
    {
        check_amount();
        check_attributes();
        if (std::dynamic_pointer_cast<const NodeHandle>(source.object))
            throw Error("source is a node; to emit from its points, use :spawn { from = ... }");
        if (!source_.is(source.object, from, density, source_group)) {
            BirthSource next(source.object, from, density, source_group);
            next.follow(source_);
            source_ = std::move(next);
        }
        check_source();
    }

    Flow start(std::span<Flow> inputs, const Evaluation& now)
    {
        Flow flow = std::move(inputs[0]);
        const Simulation& simulation = *flow.simulation;
        if (impulse && !impulse->empty() && impulse->begin()->first < simulation.start)
            throw Error(fmt::format("impulse[{}] is before the first frame; frames begin at {}",
                                    impulse->begin()->first, simulation.start));
        clock_ = BirthClock(simulation.start);
        move_source(simulation, now);
        emit(flow, clock_.at_once(impulse ? impulse_at(*impulse, simulation.start) : 0, simulation.fps), now);
        return flow;
    }

    Flow evaluate(std::span<Flow> inputs, const Evaluation& now)
    {
        if (now.at_start) return start(inputs, now);
        Flow flow = std::move(inputs[0]);
        const std::uint64_t born = now.figures.born;
        move_source(*flow.simulation, now);
        emit(flow, births(*flow.simulation, now), now);
        has_emitted_ |= now.figures.born > born;
        if (flow.simulation->trial && !has_emitted_) ++flow.simulation->trial->idle;
        return flow;
    }

    static std::unique_ptr<Operator> make() { return stateful<Emit>(); }

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(clock_, warned_unmatched_, source_);
    }

private:
    void check_amount() const
    {
        const int given = rate.has_value() + count.has_value() + impulse.has_value();
        if (given == 0) throw Error("the number of points is missing; give rate, count or impulse");
        if (given > 1)
            throw Error(fmt::format("{} are given together; give only one of them", !impulse ? "rate and count"
                                                                                    : !count ? "rate and impulse"
                                                                                    : !rate
                                                                                        ? "count and impulse"
                                                                                        : "rate, count and impulse"));
        if (impulse)
            for (const auto& [frame, n] : *impulse)
                if (n != std::floor(n))
                    throw Error(fmt::format("impulse[{}] = {} is not whole; it must be a number of points", frame, n));
    }

    void check_source() const
    {
        if (!is_zero(speed) && !source_.has_normals())
            throw Error(fmt::format("speed = {} needs a normal N, which {} does not have; give velocity instead",
                                    describe(speed), from == "volume" ? "a volume" : "this set of points"));
        for (const std::string& name : inherited()) {
            const AttributeType type = type_of(*source_.values().find(name));
            if (const AttributeSpec* known = known_attribute(name); known && type_of(known->fallback) != type)
                throw Error(fmt::format("the source has \"{}\" as {}; it must be {}", name, type_name(type),
                                        type_name(type_of(known->fallback))));
        }
        if (age) age->check(source_);
    }

    Births births(const Simulation& simulation, const Evaluation& now)
    {
        const FrameClock clock = simulation.clock();
        const std::int64_t step = clock.step_at(now.frame);
        if (simulation.trial && impulse)
            return clock_.at_once(has_impulse_by(*impulse, now.frame.number) ? trial_births : 0, clock.fps);
        if (!rate) return births_of_frame(step, clock);
        const double steps = clock.steps_per_second();
        if (*rate / steps > max_births)
            throw Error(fmt::format("rate = {} would emit {:.3g} points in a frame; at most {} are possible", *rate,
                                    *rate / steps, max_births));
        return clock_.at_rate(*rate, step, steps);
    }

    // Returns the births of `count` or `impulse`. Ages at the frame's end do not depend on subframes: simultaneous
    // births all belong to the subframe that contains their time.
    Births births_of_frame(std::int64_t step, const FrameClock& clock)
    {
        const std::int64_t parts = clock.subframes, before = step - 1 - clock.start, part = before % parts;
        const auto n =
            static_cast<std::size_t>(count ? *count : impulse_at(*impulse, clock.start + 1 + before / parts));
        if (!age && (birth.when == "random" || birth.when == "even"))
            return clock_.at_once(n, clock.fps, static_cast<int>(part), clock.subframes);
        const bool here = part == (age || birth.when == "end" ? parts - 1 : 0);
        return clock_.at_once(here ? n : 0, clock.fps);
    }

    // Returns the source's attributes that `attributes` does not replace.
    std::vector<std::string> inherited() const
    {
        std::vector<std::string> names = source_.inherited();
        std::erase_if(names, [&](const std::string& name) { return attributes.has(name); });
        return names;
    }

    std::vector<AttributeSpec> made() const
    {
        std::vector<AttributeSpec> specs = given();
        for (const std::string& name : inherited())
            std::visit([&](const auto& c) { specs.push_back(attribute_like(name, c.fallback())); },
                       *source_.values().find(name));
        return specs;
    }

    void move_source(const Simulation& simulation, const Evaluation& now);
    void emit(Flow& flow, Births births, const Evaluation& now);

    // Throws Error if the newborn points, plus a copy of the existing ones, do not fit in memory.
    void require_room(const PointSet& points, std::size_t n) const
    {
        const double bytes = static_cast<double>(n) * bytes_per_birth + static_cast<double>(points.bytes());
        if (fits_in_memory(bytes)) return;
        const char* amount = rate ? "rate" : count ? "count" : "impulse";
        throw memory_exceeded(fmt::format("{} births in a frame, in addition to {} points,", n, points.size()), bytes,
                              fmt::format("give a smaller {}", amount));
    }

    void make_columns(PointSet& points, const BirthAges& ages, const Evaluation& now) const;
    void append(PointSet& points, std::size_t n, const BirthAges& ages, const BirthVelocity& velocity,
                const Evaluation& now) const;
    NewbornColumns newborn_columns(PointSet& points, std::size_t n, const BirthAges& ages,
                                   const BirthVelocity& velocity, const Evaluation& now) const;
    void fill(const NewbornColumns& newborn, const Chosen& chosen, std::size_t first, std::span<Birthplace> birthplaces,
              const BirthAges& ages, const BirthVelocity& velocity, const Evaluation& now) const;

    Subset subset_;
    BirthClock clock_;
    bool at_beginning_ = false;  // of an interval: see BirthSource::Move
    bool warned_unmatched_ = false;
    bool has_emitted_ = false;    // read in trials
    mutable BirthSource source_;  // rebuilt from `source` and `from` when they change
};
RAPID_NODE(Emit);
RAPID_COUPLING("emit", Emit);
RAPID_GRAPH_ERROR("emit", Emit, "");  // each birth has its own time in the frame, and a newborn point moves from there

void Emit::move_source(const Simulation& simulation, const Evaluation& now)
{
    PathOptions options;
    options.kind = motion == "spline"   ? PathOptions::Spline
                   : motion == "linear" ? PathOptions::Linear
                                        : PathOptions::None;
    options.alpha = alpha;
    if (cut) options.cuts = cut->frames;
    const auto frame = static_cast<std::int64_t>(std::ceil(now.frame.number));
    const BirthSource::Move move = source_.move_to(simulation.clock(), simulation.clock().step_at(now.frame), options);
    at_beginning_ = move.at_beginning;
    if (move.unmatched > 0 && !std::exchange(warned_unmatched_, true))
        now.warnings.push_back(fmt::format(
            "{}:{}: node \"{}\": by their ids, {} of {} points of the source are new in frame {}; they emit along "
            "their v, or at their position",
            now.location.file, now.location.line, now.node, move.unmatched, source_.values().size(), frame));
    if (move.jump)
        now.warnings.push_back(
            fmt::format("{}:{}: node \"{}\": the source {}; no points are born on the way (to confirm, give cut = "
                        "{{{}}}; if it is not a jump, cut = {{}})",
                        now.location.file, now.location.line, now.node, describe(*move.jump, frame), frame));
}

void Emit::emit(Flow& flow, Births births, const Evaluation& now)
{
    PointSet& points = flow.points;
    const BirthAges ages(age, birth.when, source_, now.at_start ? 0 : now.frame.dt);
    make_columns(points, ages, now);
    if (source_.empty()) births.count = 0;
    if (flow.simulation->trial) births.count = std::min(births.count, trial_births);
    const std::int64_t first_id = flow.simulation->next_id;
    flow.simulation->next_id += static_cast<std::int64_t>(births.count);
    const Chosen chosen = choose(births, subset_, first_id);
    const std::size_t n = chosen.size();
    if (n == 0) return;
    require_room(points, n);

    const BirthVelocity velocities(velocity, speed, spread, inherit_velocity, source_);
    append(points, n, ages, velocities, now);
    const NewbornColumns newborn = newborn_columns(points, n, ages, velocities, now);
    for_each_chunk(n, [&](std::size_t chunk_begin, std::size_t chunk_end) {
        std::array<Birthplace, batch_size> birthplaces;
        for (std::size_t begin = chunk_begin; begin < chunk_end; begin += batch_size)
            fill(newborn, chosen, begin, std::span(birthplaces).first(std::min(batch_size, chunk_end - begin)), ages,
                 velocities, now);
        const Items in_frame = chosen.in_frame(0);
        for (std::size_t i = chunk_begin; i < chunk_end; ++i)
            newborn.id[i] = first_id + static_cast<std::int64_t>(in_frame[i]);
    });
    now.figures.born += n;
    if (birth.edit) birth.edit->edit(points, points.size() - n, now);
}

// Creates the columns even if nothing is born, so that all frames have the same columns.
void Emit::make_columns(PointSet& points, const BirthAges& ages, const Evaluation& now) const
{
    for (const AttributeSpec& spec : made())
        if (now.keeps(spec.name)) points.add(spec);
    if (life && may_end())
        for (const char* name : {"age", "life"})
            if (now.keeps(name)) points.add(*known_attribute(name));
    if (joins_group(now)) points.group(joins);

    const bool whole_frames = ages.common() && *ages.common() >= ages.frame_length();
    if (!now.at_start && !whole_frames) points.add({"dt", static_cast<float>(now.frame.dt)});
}

// Appends n points. A value shared by all newborn points is set uniformly, so that a uniform column stays uniform.
void Emit::append(PointSet& points, std::size_t n, const BirthAges& ages, const BirthVelocity& velocities,
                  const Evaluation& now) const
{
    std::vector<AttributeSpec> common;
    for (const auto& [name, value] : attributes.of) common.push_back({name, value.first()});
    for (const std::string& name : inherited())
        std::visit(
            [&](const auto& column) {
                if (column.is_uniform()) common.push_back({name, column[0]});
            },
            *source_.values().find(name));
    if (velocities.is_common()) common.push_back({"v", velocities.common()});
    if (life && life->is_single()) common.push_back({"life", static_cast<float>(life->min)});
    if (const std::optional<double>& L = ages.common()) {
        const double gamma = std::min(*L, ages.frame_length());
        common.push_back({"dt", static_cast<float>(gamma)});
        common.push_back({"age", static_cast<float>(*L - gamma)});
        common.push_back({"birthtime", static_cast<float>(now.frame.time - *L)});
    } else if (!age) {
        common.push_back({"age", 0.0f});
    }
    points.append(n, common, joins_group(now) ? std::vector{joins} : std::vector<std::string>());
}

NewbornColumns Emit::newborn_columns(PointSet& points, std::size_t n, const BirthAges& ages,
                                     const BirthVelocity& velocities, const Evaluation& now) const
{
    const auto floats = [&](const char* name, bool own) {
        Column<float>* column = own ? points.find<float>(name) : nullptr;
        return column ? expanded(*column).last(n) : std::span<float>();
    };
    const bool own_age = !ages.common();
    NewbornColumns newborn;
    newborn.P = points.P().write().last(n);
    newborn.id = points.id().write().last(n);
    if (!velocities.is_common()) newborn.v = points.v().write().last(n);
    newborn.dt = floats("dt", own_age);
    newborn.age = floats("age", own_age && age);
    newborn.birthtime = floats("birthtime", own_age);
    newborn.life = floats("life", life && !life->is_single());
    newborn.draw = draws_of(points, n, now);
    for (const std::string& name : inherited())
        std::visit(
            [&](const auto& column) {
                if (!now.keeps(name)) return;
                using T = std::decay_t<decltype(column[0])>;
                if (column.is_uniform()) return;
                newborn.inherit.push_back([this, values = column.read(), to = points.column<T>(name).write().last(n)](
                                              std::size_t first, std::span<const Birthplace> birthplaces) {
                    for (std::size_t i = 0; i < birthplaces.size(); ++i)
                        to[first + i] = source_.value(values, birthplaces[i]);
                });
            },
            *source_.values().find(name));
    return newborn;
}

// Fills a batch of births, from index `first` of the chosen ones on, column by column.
void Emit::fill(const NewbornColumns& newborn, const Chosen& chosen, std::size_t first,
                std::span<Birthplace> birthplaces, const BirthAges& ages, const BirthVelocity& velocities,
                const Evaluation& now) const
{
    const std::size_t size = birthplaces.size();
    const Items numbers = chosen.numbers(first);
    std::array<Draws, batch_size> draw_buffer;
    std::array<double, batch_size> age_buffer;
    const std::span<Draws> draws = std::span(draw_buffer).first(size);
    const std::span<double> L = std::span(age_buffer).first(size);

    const bool own_age = !ages.common();
    if (own_age || velocities.is_random() || !newborn.life.empty()) uniform4(now.random, numbers, draw_use, draws);
    source_.place(now.random, numbers, /*in_order=*/!rate, birthplaces);
    if (own_age || source_.moves()) ages.find(chosen.births, chosen.in_frame(first), birthplaces, draws, L);
    const auto time_of = [&](std::size_t i) { return at_beginning_ ? 0 : std::max(0.0, 1 - L[i] / now.frame.dt); };
    if (source_.redraws())
        source_.redraw(now.random, numbers, birthplaces, [&](std::size_t i) {
            ages.find(chosen.births, chosen.in_frame(first + i), birthplaces.subspan(i, 1), draws.subspan(i, 1),
                      L.subspan(i, 1));
            return time_of(i);
        });
    std::array<double, batch_size> times;
    const std::span<double> t = std::span(times).first(source_.moves() ? size : 0);
    for (std::size_t i = 0; i < t.size(); ++i) t[i] = time_of(i);
    for (const auto& inherit_attribute : newborn.inherit) inherit_attribute(first, birthplaces);
    for (const auto& draw_attribute : newborn.draw) draw_attribute(first, size, numbers);

    if (own_age) {
        for (std::size_t i = 0; i < size; ++i) {
            const double gamma = std::min(L[i], ages.frame_length());
            if (!newborn.dt.empty()) newborn.dt[first + i] = static_cast<float>(gamma);
            if (!newborn.age.empty()) newborn.age[first + i] = static_cast<float>(L[i] - gamma);
            if (!newborn.birthtime.empty()) newborn.birthtime[first + i] = static_cast<float>(now.frame.time - L[i]);
        }
    }
    std::array<Vec3d, batch_size> source_motion;  // m/s, of the birthplaces
    if (source_.moves()) {
        source_.path().carry(t, velocities.needs_normals(), birthplaces, std::span(source_motion).first(size));
        for (std::size_t i = 0; i < size; ++i) source_motion[i] /= now.frame.dt;
    }
    for (std::size_t i = 0; i < size; ++i) newborn.P[first + i] = birthplaces[i].P;
    if (!newborn.life.empty())
        for (std::size_t i = 0; i < size; ++i)
            newborn.life[first + i] = static_cast<float>(life->at(draws[i][life_draw]));
    if (newborn.v.empty()) return;
    std::array<Draws, batch_size> speed_draws;
    if (!speed.is_single()) uniform4(now.random, numbers, speed_use, std::span(speed_draws).first(size));
    velocities.find(birthplaces, draws, speed_draws, source_motion, newborn.v.subspan(first, size));
}

}  // namespace
}  // namespace rapid

// emit: emits points from a surface, from a volume or at points, which may be at rest, moving or deforming (paper §3).
//
// A newborn point is appended where it is born and as it is then. With the age L at the end of its first frame
// (emit/birth_age.h), its column `dt` holds γ = min(L, h), the time for which Solve advances it in this frame, and its
// age is L - γ, so that it grows to L by the frame's end.
//
// A moving source emits each point from where its birthplace is at the time of birth, t = 1 - L / h of the path from
// the previous frame (shapes/motion/body_path.h); emit/birth_velocity.h has the equation of the velocity.
//
// A source that is a node bears by its points, each along its path through the frame (emit/parent_paths.h), by rate and
// count of each (emit/parent_clock.h). Points of another simulation, which comes before, have their path in this frame;
// those of the same simulation move later in the frame, and bear along their path of the frame before.
//
// A birth's random numbers depend on the seed, on the name of this node and on the birth's number in this emitter, or
// among the births of its parent. Births that a subset of the points leaves out (points/subset.h) have their number and
// their id, and nothing else is computed of them.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "runtime/graph/coupling.h"
#include "runtime/graph/frame_set.h"
#include "runtime/graph/node.h"
#include "runtime/graph/stateful.h"
#include "runtime/memory_budget.h"
#include "runtime/operators/emit/birth_age.h"
#include "runtime/operators/emit/birth_moment.h"
#include "runtime/operators/emit/birth_source.h"
#include "runtime/operators/emit/birth_values.h"
#include "runtime/operators/emit/birth_velocity.h"
#include "runtime/operators/emit/births.h"
#include "runtime/operators/emit/chosen_births.h"
#include "runtime/operators/emit/draws.h"
#include "runtime/operators/emit/emit_source.h"
#include "runtime/operators/emit/inheritance.h"
#include "runtime/operators/emit/interval.h"
#include "runtime/operators/emit/newborn_columns.h"
#include "runtime/operators/emit/parent_emitter.h"
#include "runtime/parallel.h"
#include "runtime/points/attribute_like.h"

namespace rapid {
namespace {

constexpr std::size_t batch_size = 256;     // births at a time, in the first-level cache
constexpr double most_births = 2147483647;  // in a frame
constexpr std::size_t trial_births = 64;    // of a frame, in a trial (Evaluator::examine)

struct Emit {
    EmitSource source;
    std::string from, density, joins;
    BirthMoment birth;
    std::optional<Amount<double>> rate;
    std::optional<Amount<int>> count;
    std::optional<std::map<std::int64_t, double>> impulse;
    std::optional<BirthAge> age;
    std::optional<Interval> life;
    std::string motion;
    double alpha;
    std::optional<FrameSet> cut;
    Inheritance inherit;
    Interval speed;
    double spread;
    Vec3d velocity;
    BirthValues attributes;

    // Of a source that is a node.
    std::string source_group;
    std::optional<BirthEvent> on;
    std::optional<double> min_speed, limit, inherit_velocity;
    bool split, kill_parent;

    static NodeType declare()
    {
        auto type = node<Emit>("emit", "Bears points from a surface, in a volume, at points, or from those of a node.");
        declare_births(type);
        declare_parents(type);
        return type;
    }

    static void declare_births(Declaration<Emit>& type)
    {
        type.varies()
            .stage(Stage::Emission)
            .writes("P")
            .writes("v")
            .writes("id")
            .param(&Emit::source, "source", Value(), any_number(), "", "what points are born from")
            .required()
            .param(&Emit::from, "from", Value(), any_number(), "",
                   "where on the source; without it \"points\" of points, else \"surface\". A mesh's points are its "
                   "vertices. With count or impulse points are taken in order, so that as many births as points take "
                   "each once; with rate at random")
            .choices({"surface", "volume", "points"})
            .param(&Emit::density, "density", Value(), any_number(), "",
                   "an attribute of the source's points, or of a mesh's vertices: births are drawn in proportion to it")
            .param(&Emit::rate, "rate", Value(), at_least(0), "1/s",
                   "points born a second; of a node, by each of its points")
            .param(&Emit::count, "count", Value(), at_least(0), "",
                   "points born a frame; of a node, by each of its points, a frame or an event")
            .param(&Emit::impulse, "impulse", Value(), between(0, most_births), "",
                   "points born in single frames, {[frame] = count}; at the first frame they have not moved yet")
            .param(&Emit::birth, "birth", "random", any_number(), "",
                   "at the beginning of the frame's interval, its end, at random, or evenly spaced; or a function(p, "
                   "frame) that edits each newborn point once, which is born at random")
            .choices({"random", "begin", "end", "even"})
            .constant()
            .param(
                &Emit::age, "age", Value(), at_least(0), "s",
                "age at the end of the frame of birth, instead of `birth`; a number, {min, max}, or the source's own "
                "attribute, rapid.attr")
            .param(&Emit::motion, "motion", "spline", any_number(), "",
                   "the way of a moving source within a frame: a cubic through the frames around it, a straight line, "
                   "or none, as if it were where it is at the frame's end, at rest")
            .choices({"spline", "linear", "none"})
            .param(
                &Emit::alpha, "alpha", 0.5, any_number(), "",
                "tangents of the spline, as a part of the way over two frames; a half keeps a uniform motion uniform")
            .param(
                &Emit::cut, "cut", Value(), between(-most_births, most_births), "",
                "frames to which the source jumps from the frame before: nothing is born on the way. Where it is not "
                "given, a step of 8 times those around it and half the source's size is a jump, and reported")
            .param(&Emit::inherit, "inherit", 1.0, any_number(), "",
                   "fraction of the source's velocity that is added; of a node, also names of attributes that the "
                   "newborn have of their parents")
            .param(&Emit::velocity, "velocity", Vec3d(0, 0, 0), any_number(), "m/s", "mean direction and size")
            .param(&Emit::speed, "speed", 0.0, any_number(), "m/s",
                   "along the source's normal N, added to velocity; a number or {min, max}")
            .param(&Emit::spread, "spread", 0.0, between(0, 180), "deg",
                   "turns velocity and speed together, uniformly in a cone of this half angle")
            .param(&Emit::life, "life", Value(), or_infinity(at_least(0)), "s",
                   "age at which points die: a number or {min, max}; without it they live for ever")
            .param(&Emit::joins, "group", Value(), any_number(), "", "the newborn join this group")
            .constant()
            .param(&Emit::attributes, "attributes", Value(), any_number(), "",
                   "values of the newborn, {heat = 1, Cd = {1, 0.5, 0}}; at random between two, {heat = {1, 2}}, or on "
                   "a ramp, {Cd = {{0, {1, 0, 0}}, {1, {1, 1, 0}}}}; they go before the source's own");
    }

    static void declare_parents(Declaration<Emit>& type)
    {
        type.param(&Emit::source_group, "source_group", Value(), any_number(), "",
                   "of a node: only its points in this group bear; of a mesh: only its faces in this group")
            .constant()
            .param(&Emit::on, "on", Value(), any_number(), "",
                   "of a node: births at an event, count of each (1), not all the time: \"hit\", \"death\", \"birth\", "
                   "when a comparison of an attribute with a number (\"age > 0.5\", \"P.y < 0\") begins to hold, or a "
                   "function of a point begins to be true")
            .constant()
            .param(&Emit::min_speed, "min_speed", Value(), at_least(0), "m/s",
                   "with on = \"hit\": the least speed of approach")
            .param(&Emit::limit, "limit", Value(), at_least(0), "", "of a node: the most births of one point")
            .param(&Emit::inherit_velocity, "inherit_velocity", Value(), any_number(), "",
                   "of a node: fraction of the parent's velocity at the birth that is added (1)")
            .param(&Emit::split, "split", false, any_number(), "",
                   "of a node: those that are born together share the parent's mass and volume")
            .param(&Emit::kill_parent, "kill_parent", false, any_number(), "",
                   "with on: a point that has borne is removed");
    }

    void uses(Uses& uses) const
    {
        for (const AttributeSpec& spec : source.is_node ? ParentEmitter::made(parent_options(), uses) : made())
            uses.makes.push_back(spec);
        if (source.is_node) ParentEmitter::use(parent_options(), uses);
        uses.gives.insert(uses.gives.end(), {"age", "birthtime"});
        if (life && (may_end() || uses.functions.count("life"))) uses.gives.push_back("life");
        const bool whole_frames = !age && birth.when == "begin";
        if (source.is_node || !whole_frames) uses.writes.push_back("dt");
        if (!joins.empty()) uses.makes_groups.push_back(joins);
        if (birth.edit) birth.function->uses(uses);
    }

    std::string couples(const Plan&, const PlannedNode&) const
    {
        return source.is_node ? "its births are numbered over all points of its source" : "";
    }

    void take(const Subset& subset) { subset_ = subset; }

    std::optional<std::vector<float>> values(const std::string& attribute, float fallback) const
    {
        if (const auto given = attributes.of.find(attribute); given != attributes.of.end()) {
            const auto* number = std::get_if<float>(&given->second.first());
            return number && given->second.is_common() ? std::optional(std::vector{*number}) : std::nullopt;
        }
        if (source.is_node) return std::nullopt;
        const auto* own = source_.values().find<float>(attribute);
        if (!own) return std::vector{fallback};
        return own->is_uniform() && own->size() > 0 ? std::optional(std::vector{(*own)[0]}) : std::nullopt;
    }

    void check() const
    {
        check_amount();
        check_attributes();
        check_kind();
        if (source.is_node) return;
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
        if (source.is_node) {
            bear_from_parents(flow, inputs.subspan(1), now);
            return flow;
        }
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
        if (source.is_node) {
            bear_from_parents(flow, inputs.subspan(1), now);
        } else {
            move_source(*flow.simulation, now);
            emit(flow, births(*flow.simulation, now), now);
        }
        has_emitted_ |= now.figures.born > born;
        if (flow.simulation->trial && !has_emitted_) ++now.figures.idle;
        return flow;
    }

    static std::unique_ptr<Operator> make() { return stateful<Emit>(); }

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(clock_, warned_unmatched_, source_, parents_);
    }

private:
    void check_amount() const
    {
        const int given = rate.has_value() + count.has_value() + impulse.has_value();
        if (given == 0 && on) return;
        if (given == 0) throw Error("nothing says how many points are born; give rate, count or impulse");
        if (given > 1)
            throw Error(fmt::format("{} are given together; keep one of them", !impulse ? "rate and count"
                                                                               : !count ? "rate and impulse"
                                                                               : !rate  ? "count and impulse"
                                                                                        : "rate, count and impulse"));
        if (impulse)
            for (const auto& [frame, n] : *impulse)
                if (n != std::floor(n))
                    throw Error(fmt::format("impulse[{}] = {} is not whole; it must be a number of points", frame, n));
    }

    void check_attributes() const
    {
        for (const auto& [name, value] : attributes.of)
            for (const auto& [own, remedy] : {std::pair{"age", "use age"},
                                              {"life", "use life"},
                                              {"birthtime", "it is the time of birth, where something reads it"}})
                if (name == own) throw Error(fmt::format("attributes: \"{}\" has its own way; {}", name, remedy));
    }

    void check_source() const
    {
        if (!is_zero(speed) && !source_.has_normals())
            throw Error(fmt::format("speed = {} goes along N, which {} does not have; give velocity instead",
                                    describe(speed), from == "volume" ? "a volume" : "this set of points"));
        for (const std::string& name : inherited()) {
            const AttributeType type = type_of(*source_.values().find(name));
            if (const AttributeSpec* known = known_attribute(name); known && type_of(known->fallback) != type)
                throw Error(fmt::format("the source has \"{}\" as {}; it must be {}", name, type_name(type),
                                        type_name(type_of(known->fallback))));
        }
        if (age) age->check(source_);
    }

    void check_kind() const;
    ParentOptions parent_options(double wait = 0) const;
    void bear_from_parents(Flow& flow, std::span<const Flow> sources, const Evaluation& now);

    Births births(const Simulation& simulation, const Evaluation& now)
    {
        const FrameClock clock = simulation.clock();
        const std::int64_t step = clock.step_at(now.frame);
        if (simulation.trial && impulse)
            return clock_.at_once(has_impulse_by(*impulse, now.frame.number) ? trial_births : 0, clock.fps);
        if (!rate) return births_of_frame(step, clock);
        const double steps = clock.steps_per_second();
        if (rate->value / steps > most_births)
            throw Error(fmt::format("rate = {} would bear {:.3g} points in a frame; at most {} fit", rate->value,
                                    rate->value / steps, most_births));
        return clock_.at_rate(rate->value, step, steps);
    }

    // Of `count` or `impulse`. Ages at the frame's end do not depend on sub-frames: births at one instant all belong to
    // the sub-frame that holds it.
    Births births_of_frame(std::int64_t step, const FrameClock& clock)
    {
        const std::int64_t parts = clock.subframes, before = step - 1 - clock.start, part = before % parts;
        const auto n =
            static_cast<std::size_t>(count ? count->value : impulse_at(*impulse, clock.start + 1 + before / parts));
        if (!age && (birth.when == "random" || birth.when == "even"))
            return clock_.at_once(n, clock.fps, static_cast<int>(part), clock.subframes);
        const bool here = part == (age || birth.when == "end" ? parts - 1 : 0);
        return clock_.at_once(here ? n : 0, clock.fps);
    }

    // The source's attributes that `attributes` does not replace.
    std::vector<std::string> inherited() const
    {
        std::vector<std::string> names = source_.inherited();
        std::erase_if(names, [&](const std::string& name) { return attributes.has(name); });
        return names;
    }

    // Whether newborn points are mortal.
    bool may_end() const { return std::isfinite(life->min); }

    std::vector<AttributeSpec> made() const
    {
        std::vector<AttributeSpec> specs;
        for (const auto& [name, value] : attributes.of) specs.push_back(attribute_like(name, value.first()));
        for (const std::string& name : inherited())
            std::visit([&](const auto& c) { specs.push_back(attribute_like(name, c.fallback())); },
                       *source_.values().find(name));
        return specs;
    }

    bool joins_group(const Evaluation& now) const { return !joins.empty() && now.keeps_group(joins); }
    void move_source(const Simulation& simulation, const Evaluation& now);
    void emit(Flow& flow, Births births, const Evaluation& now);

    // Error: no memory for so many newborn, with a copy of those that are there.
    void require_room(const PointSet& points, std::size_t n) const
    {
        const double bytes = static_cast<double>(n) * bytes_a_birth + static_cast<double>(points.bytes());
        if (fits_in_memory(bytes)) return;
        const char* amount = rate ? "rate" : count ? "count" : "impulse";
        throw beyond_memory(fmt::format("{} births in a frame, behind {} points,", n, points.size()), bytes,
                            fmt::format("give a smaller {}", amount));
    }

    void make_columns(PointSet& points, const BirthAges& ages, const Evaluation& now) const;
    void append(PointSet& points, std::size_t n, const BirthAges& ages, const BirthVelocity& velocity,
                const Evaluation& now) const;
    NewbornColumns newborn_columns(PointSet& points, std::size_t n, const BirthAges& ages,
                                   const BirthVelocity& velocity, const Evaluation& now) const;
    void fill(const NewbornColumns& newborn, const Chosen& chosen, std::size_t first, std::span<Birthplace> places,
              const BirthAges& ages, const BirthVelocity& velocity, const Evaluation& now) const;

    Subset subset_;
    BirthClock clock_;
    bool at_beginning_ = false;  // of an interval: see BirthSource::Move
    bool warned_unmatched_ = false;
    bool has_emitted_ = false;    // read in trials
    mutable BirthSource source_;  // made from `source` and `from` when they change
    ParentEmitter parents_;       // where it is a node
};
RAPID_NODE(Emit);
RAPID_COUPLING("emit", Emit);

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
            "{}:{}: node \"{}\": {} of {} points of the source were not in it at the frame before {}, by "
            "their ids; they bear along their v, or where they are",
            now.location.file, now.location.line, now.node, move.unmatched, source_.values().size(), frame));
    if (move.jump)
        now.warnings.push_back(
            fmt::format("{}:{}: node \"{}\": the source {}; nothing is born on the way (cut = {{{}}} says so, cut = "
                        "{{}} that it is "
                        "no jump)",
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

    const BirthVelocity velocities(velocity, speed, spread, inherit.share, source_);
    append(points, n, ages, velocities, now);
    const NewbornColumns newborn = newborn_columns(points, n, ages, velocities, now);
    for_each_chunk(n, [&](std::size_t chunk_begin, std::size_t chunk_end) {
        std::array<Birthplace, batch_size> places;
        for (std::size_t begin = chunk_begin; begin < chunk_end; begin += batch_size)
            fill(newborn, chosen, begin, std::span(places).first(std::min(batch_size, chunk_end - begin)), ages,
                 velocities, now);
        const Items in_frame = chosen.in_frame(0);
        for (std::size_t i = chunk_begin; i < chunk_end; ++i)
            newborn.id[i] = first_id + static_cast<std::int64_t>(in_frame[i]);
    });
    now.figures.born += n;
    if (birth.edit) birth.edit->edit(points, points.size() - n, now);
}

// Whether anything is born or not: all frames have the same columns.
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

// A value that all newborn share is given to its column as one, so that a uniform column stays uniform.
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
    for (const auto& [name, value] : attributes.of)
        if (!value.is_common() && now.keeps(name))
            newborn.draw.push_back(draw_values(value, *points.find(name), n, now.random, name));
    for (const std::string& name : inherited())
        std::visit(
            [&](const auto& column) {
                if (!now.keeps(name)) return;
                using T = std::decay_t<decltype(column[0])>;
                if (column.is_uniform()) return;
                newborn.inherit.push_back([this, values = column.read(), to = points.column<T>(name).write().last(n)](
                                              std::size_t first, std::span<const Birthplace> places) {
                    for (std::size_t i = 0; i < places.size(); ++i) to[first + i] = source_.value(values, places[i]);
                });
            },
            *source_.values().find(name));
    return newborn;
}

// The births of a batch, the first-th of those chosen and the following, column by column.
void Emit::fill(const NewbornColumns& newborn, const Chosen& chosen, std::size_t first, std::span<Birthplace> places,
                const BirthAges& ages, const BirthVelocity& velocities, const Evaluation& now) const
{
    const std::size_t size = places.size();
    const Items numbers = chosen.numbers(first);
    std::array<Draws, batch_size> draw_buffer;
    std::array<double, batch_size> age_buffer;
    const std::span<Draws> draws = std::span(draw_buffer).first(size);
    const std::span<double> L = std::span(age_buffer).first(size);

    const bool own_age = !ages.common();
    if (own_age || velocities.is_random() || !newborn.life.empty()) uniform4(now.random, numbers, draw_use, draws);
    source_.place(now.random, numbers, /*in_order=*/!rate, places);
    for (const auto& inherit_attribute : newborn.inherit) inherit_attribute(first, places);
    for (const auto& draw_attribute : newborn.draw) draw_attribute(first, size, numbers);

    if (own_age || source_.moves()) ages.find(chosen.births, chosen.in_frame(first), places, draws, L);
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
        std::array<double, batch_size> t;
        for (std::size_t i = 0; i < size; ++i) t[i] = at_beginning_ ? 0 : std::max(0.0, 1 - L[i] / now.frame.dt);
        source_.path().carry(std::span(t).first(size), velocities.needs_normals(), places,
                             std::span(source_motion).first(size));
        for (std::size_t i = 0; i < size; ++i) source_motion[i] /= now.frame.dt;
    }
    for (std::size_t i = 0; i < size; ++i) newborn.P[first + i] = places[i].P;
    if (!newborn.life.empty())
        for (std::size_t i = 0; i < size; ++i)
            newborn.life[first + i] = static_cast<float>(life->at(draws[i][life_draw]));
    if (newborn.v.empty()) return;
    std::array<Draws, batch_size> speed_draws;
    if (!speed.is_single()) uniform4(now.random, numbers, speed_use, std::span(speed_draws).first(size));
    velocities.find(places, draws, speed_draws, source_motion, newborn.v.subspan(first, size));
}

void Emit::check_kind() const  // what only a node as source has, or only another
{
    const std::pair<bool, const char*> of_node[] = {{on.has_value(), "on"},
                                                    {min_speed.has_value(), "min_speed"},
                                                    {limit.has_value(), "limit"},
                                                    {split, "split"},
                                                    {kill_parent, "kill_parent"},
                                                    {!inherit.names.empty(), "inherit = {names}"},
                                                    {inherit_velocity.has_value(), "inherit_velocity"},
                                                    {rate && !rate->attribute.empty(), "rate = rapid.attr"},
                                                    {count && !count->attribute.empty(), "count = rapid.attr"}};
    const std::pair<bool, const char*> of_others[] = {{!from.empty(), "from"},        {impulse.has_value(), "impulse"},
                                                      {!density.empty(), "density"},  {age.has_value(), "age"},
                                                      {motion != "spline", "motion"}, {alpha != 0.5, "alpha"},
                                                      {cut.has_value(), "cut"}};
    for (const auto& [given, name] : of_node)
        if (given && !source.is_node)
            throw Error(fmt::format("{} is for a source that is a node; give one, or leave it out", name));
    for (const auto& [given, name] : of_others)
        if (given && source.is_node)
            throw Error(fmt::format("{} is not for a source that is a node; leave it out", name));
    if (on && rate) throw Error("rate and on are given together; with an event give count, the births of each");
    if (on && birth.when != "random")
        throw Error(fmt::format("birth = \"{}\" and on are given together; an event has its own moment", birth.when));
    if (min_speed && !(on && on->kind == BirthEvent::Hit))
        throw Error("min_speed is for on = \"hit\"; leave it out, or give on");
    if (kill_parent && (!on || on->kind == BirthEvent::Death))
        throw Error("kill_parent is for births at an event in a parent's life; give on, and not \"death\"");
    if (inherit.share != 1 && inherit_velocity)
        throw Error("inherit and inherit_velocity are given together; keep one of them");
}

ParentOptions Emit::parent_options(double wait) const
{
    return {{rate, count, on, min_speed.value_or(0), limit, birth.when},
            {velocity, speed, spread, inherit_velocity.value_or(inherit.share), life, attributes, inherit.names, joins,
             split, wait},
            source_group,
            kill_parent};
}

void Emit::bear_from_parents(Flow& flow, std::span<const Flow> sources, const Evaluation& now)
{
    if (sources.empty()) throw Error("source: a function of the frame can't give a node; give the node itself");
    const Flow& parents = sources.front();
    // Points of the same chain move after this node: their last path is that of the frame before.
    const bool waits = parents.simulation == flow.simulation && !now.at_start;
    const std::uint64_t born = now.figures.born;
    parents_.bear(flow, parents, parent_options(waits ? now.frame.dt : 0),
                  flow.simulation->trial ? trial_births : SIZE_MAX, now);
    if (birth.edit) birth.edit->edit(flow.points, flow.points.size() - (now.figures.born - born), now);
}

}  // namespace
}  // namespace rapid

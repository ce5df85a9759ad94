// emit: bears points from a surface, in a volume or at points, at rest, moving or deforming (paper §3).
//
// A point born in the frame's interval has the age L at the frame's end, 0 <= L <= h: h for birth = "begin", 0 for
// "end", uniform between for "random", h less its exact time for "even". It is appended where and as it is born; its
// column `dt` has γ = min(L, h), the time for which Solve advances it in this frame, so that its age grows to L by the
// end.
//
//   velocity = C(velocity + speed N) + inherit v_source      C turns a vector uniformly in a cone of half angle
//   `spread`
//
// A moving source bears each point where its place is at the time of birth, t = 1 - L / h of the way from the frame
// before (shapes/body_path.h), and v_source is the derivative of that way, with the source's own attribute v added.
//
// A birth's random numbers depend on the seed, this node's name and the birth's number within this emitter; each
// question has a number of its own, so that a parameter more changes no answer to another.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "runtime/graph/frame_set.h"
#include "runtime/graph/node.h"
#include "runtime/operators/birth_source.h"
#include "runtime/operators/births.h"
#include "runtime/parallel.h"

namespace rapid {
namespace {

// The numbers of a birth: its age, its life, and two for its direction. What comes from the source has others
// (birth_source.h).
constexpr std::uint64_t draw_use = 16;
enum Draw { age_draw, life_draw, cone_draw, turn_draw };

// Births are placed in blocks that stay in the first-level cache.
constexpr std::size_t block_size = 256;

constexpr double most_births = 2147483647;  // in a frame
constexpr std::size_t tried_births = 64;    // of them, where a sample will do

struct EmitSource {
    static constexpr std::string_view param_type = "mesh, level set, shape or points";
    ObjectPtr object;
};

void read_value(const Param& param, const Value& value, EmitSource& field)
{
    read_value(param, value, field.object);
    if (!field.object) wrong_type(param, value);
}

// One number for all points, or each point's own, uniform between two.
struct Interval {
    static constexpr std::string_view param_type = "number or {min, max}";
    double min = 0, max = 0;

    bool is_single() const { return min == max; }
    double at(double u) const { return is_single() ? min : min + (max - min) * u; }
};

void read_value(const Param& param, const Value& value, Interval& field)
{
    const Table* table = value.table();
    if (!table) {
        if (!value.get<double>()) wrong_type(param, value);
        read_value(param, value, field.min);
        field.max = field.min;
        return;
    }
    if (table->list.size() != 2 || !table->list[0].get<double>() || !table->list[1].get<double>())
        wrong_type(param, value);
    read_value(param, table->list[0], field.min);
    read_value(param, table->list[1], field.max);
    if (field.min > field.max)
        throw Error(
            fmt::format("{} = {} is the wrong way round; it must be {{min, max}}", param.name, describe(value)));
    if (std::isinf(field.max) && !field.is_single())
        throw Error(fmt::format("{} = {} has no mean; both must be finite", param.name, describe(value)));
}

// An age at the frame's end: an interval, or the source's own attribute.
struct Age {
    static constexpr std::string_view param_type = "number, {min, max} or rapid.attr";
    Interval interval;
    std::string attribute;

    bool is_single() const { return attribute.empty() && interval.is_single(); }
};

void read_value(const Param& param, const Value& value, Age& field)
{
    if (const auto* reference = value.get<AttributeRef>())
        field = {{}, reference->name};
    else
        read_value(param, value, field.interval), field.attribute.clear();
}

// The vectors that `turn` needs of a cone of the half angle θ: 1 - cos α is uniform in [0, 1 - cos θ] where directions
// are uniform over the cone's solid angle.
class Cone {
public:
    explicit Cone(double half_angle) : depth_(2 * std::pow(std::sin(half_angle / 2), 2)) {}

    // `mean` turned, its length kept. u, w: uniform in [0, 1).
    Vec3d turn(const Vec3d& mean, double u, double w) const
    {
        const double length = mean.norm();
        if (length == 0) return mean;
        const Vec3d d = mean / length;
        const double fall = depth_ * u;  // 1 - cos α; of the cosine alone a narrow cone would keep few digits
        const double side = std::sqrt(fall * (2 - fall));
        const double turn = 2 * EIGEN_PI * w;

        // A frame about d without a branch on its direction (Duff et al. 2017).
        const double sign = std::copysign(1.0, d.z());
        const double a = -1 / (sign + d.z());
        const double b = d.x() * d.y() * a;
        const Vec3d e1(1 + sign * d.x() * d.x() * a, sign * b, -sign * d.x());
        const Vec3d e2(b, sign + d.y() * d.y() * a, -d.y());
        return length * ((1 - fall) * d + side * (std::cos(turn) * e1 + std::sin(turn) * e2));
    }

private:
    double depth_;  // 1 - cos θ
};

// The value of points that have none, of an attribute that holds values like this one.
AttributeSpec neutral(const std::string& name, const AttributeValue& like)
{
    if (const AttributeSpec* known = known_attribute(name)) return *known;
    if (name == "Cd" && std::holds_alternative<Vec3f>(like))
        return {name, Vec3f(Vec3f::Ones())};  // white, as in Houdini
    return {name, std::visit([](const auto& v) -> AttributeValue { return Column<std::decay_t<decltype(v)>>::zero(); },
                             like)};
}

// The newborn's part of the columns in which each has a value of its own, shape [n]; empty for the others.
struct Newborn {
    std::span<Vec3f> P, v;
    std::span<std::int64_t> id;
    std::span<float> dt, age, birthtime, life;
    // Attributes of the source, for the newborn from `begin` on.
    std::vector<std::function<void(std::size_t begin, std::span<const Birthplace> places)>> carry;
};

struct Emit {
    EmitSource source;
    std::string from, birth, joins;
    std::optional<double> rate;
    std::optional<int> count;
    std::optional<std::map<std::int64_t, double>> impulse;
    std::optional<Age> age;
    std::optional<Interval> life;
    std::string motion;
    double alpha = 0.5;
    std::optional<FrameSet> cut;
    double inherit = 1, speed = 0, spread = 0;
    Vec3d velocity = Vec3d::Zero();
    std::map<std::string, AttributeValue> attributes;

    static NodeType declare()
    {
        return node<Emit>("emit", "Bears points from a surface, in a volume or at points.")
            .varies()
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
            .param(&Emit::rate, "rate", Value(), at_least(0), "1/s", "points born a second")
            .param(&Emit::count, "count", Value(), at_least(0), "", "points born a frame")
            .param(&Emit::impulse, "impulse", Value(), between(0, most_births), "",
                   "points born in single frames, {[frame] = count}; at the first frame they have not moved yet")
            .param(&Emit::birth, "birth", "random", any_number(), "",
                   "when in the frame's interval: at its beginning, at its end, at random, or evenly spaced in time")
            .choices({"random", "begin", "end", "even"})
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
            .param(&Emit::inherit, "inherit", 1.0, any_number(), "", "fraction of the source's velocity that is added")
            .param(&Emit::velocity, "velocity", Vec3d(0, 0, 0), any_number(), "m/s", "mean direction and size")
            .param(&Emit::speed, "speed", 0.0, any_number(), "m/s", "along the source's normal N, added to velocity")
            .param(&Emit::spread, "spread", 0.0, between(0, 180), "deg",
                   "turns velocity and speed together, uniformly in a cone of this half angle")
            .param(&Emit::life, "life", Value(), or_infinity(at_least(0)), "s",
                   "age at which points die: a number or {min, max}; without it they live for ever")
            .param(&Emit::joins, "group", Value(), any_number(), "", "the newborn join this group")
            .constant()
            .param(&Emit::attributes, "attributes", Value(), any_number(), "",
                   "values of the newborn, {heat = 1, Cd = {1, 0.5, 0}}; they go before the source's own");
    }

    void uses(Uses& uses) const
    {
        for (const AttributeSpec& spec : made()) uses.makes.push_back(spec);
        uses.gives.insert(uses.gives.end(), {"age", "birthtime"});
        if (life && (may_end() || uses.functions.count("life"))) uses.gives.push_back("life");
        const bool whole_frames = !age && birth == "begin" && !uses.functions.count("birth");
        if (!whole_frames) uses.writes.push_back("dt");
        if (!joins.empty()) uses.makes_groups.push_back(joins);
    }

    void check() const
    {
        const int given = rate.has_value() + count.has_value() + impulse.has_value();
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

        for (const auto& [name, value] : attributes)
            for (const auto& [own, remedy] : {std::pair{"age", "use age"},
                                              {"life", "use life"},
                                              {"birthtime", "it is the time of birth, where something reads it"}})
                if (name == own) throw Error(fmt::format("attributes: \"{}\" has its own way; {}", name, remedy));

        if (!source_.is(source.object, from)) source_ = BirthSource(source.object, from);
        if (speed != 0 && !source_.has_normals())
            throw Error(fmt::format("speed = {} goes along N, which {} does not have; give velocity instead", speed,
                                    from == "volume" ? "a volume" : "this set of points"));
        for (const std::string& name : carried()) {
            const AttributeType type = type_of(*source_.values().find(name));
            if (const AttributeSpec* known = known_attribute(name); known && type_of(known->fallback) != type)
                throw Error(fmt::format("the source has \"{}\" as {}; it must be {}", name, type_name(type),
                                        type_name(type_of(known->fallback))));
        }
        check_age();
    }

    Flow start(std::span<Flow> inputs, const Evaluation& now)
    {
        Flow flow = std::move(inputs[0]);
        const Simulation& simulation = *flow.simulation;
        if (impulse && !impulse->empty() && impulse->begin()->first < simulation.start)
            throw Error(fmt::format("impulse[{}] is before the first frame; frames begin at {}",
                                    impulse->begin()->first, simulation.start));
        clock_ = BirthClock(simulation.start);
        move(simulation, now);
        bear(flow, clock_.at_once(impulse ? impulse_at(simulation.start) : 0, simulation.fps), now);
        return flow;
    }

    Flow evaluate(std::span<Flow> inputs, const Evaluation& now)
    {
        if (now.at_start) return start(inputs, now);
        Flow flow = std::move(inputs[0]);
        move(*flow.simulation, now);
        bear(flow, births(flow.simulation->clock().step_at(now.frame), flow.simulation->clock()), now);
        return flow;
    }

private:
    std::size_t impulse_at(std::int64_t frame) const
    {
        const auto found = impulse->find(frame);
        return found == impulse->end() ? 0 : static_cast<std::size_t>(found->second);
    }

    Births births(std::int64_t step, const FrameClock& clock)
    {
        if (!rate) return births_of_frame(step, clock);
        const double steps = clock.steps_per_second();
        if (*rate / steps > most_births)
            throw Error(fmt::format("rate = {} would bear {:.3g} points in a frame; at most {} fit", *rate,
                                    *rate / steps, most_births));
        return clock_.at_rate(*rate, step, steps);
    }

    // Points are as old at the frame's end as without sub-frames: what is born at one time is so in one of them.
    Births births_of_frame(std::int64_t step, const FrameClock& clock)
    {
        const std::int64_t parts = clock.subframes, before = step - 1 - clock.start, part = before % parts;
        const auto n = static_cast<std::size_t>(count ? *count : impulse_at(clock.start + 1 + before / parts));
        if (!age && (birth == "random" || birth == "even"))
            return clock_.at_once(n, clock.fps, static_cast<int>(part), clock.subframes);
        const bool here = part == (age || birth == "end" ? parts - 1 : 0);
        return clock_.at_once(here ? n : 0, clock.fps);
    }

    // The source's attributes that `attributes` does not replace.
    std::vector<std::string> carried() const
    {
        std::vector<std::string> names = source_.carried();
        std::erase_if(names, [&](const std::string& name) { return attributes.count(name) > 0; });
        return names;
    }

    // Whether a newborn's life is one that ends.
    bool may_end() const { return std::isfinite(life->min); }

    std::vector<AttributeSpec> made() const
    {
        std::vector<AttributeSpec> specs;
        for (const auto& [name, value] : attributes) specs.push_back(neutral(name, value));
        for (const std::string& name : carried())
            std::visit([&](const auto& c) { specs.push_back(neutral(name, c.fallback())); },
                       *source_.values().find(name));
        return specs;
    }

    // The age at the frame's end where it is the same for all births.
    std::optional<double> same_age(const Evaluation& now) const
    {
        if (age) return age->is_single() ? std::optional(age->interval.min) : std::nullopt;
        if (now.at_start || birth == "end") return 0.0;
        if (birth == "begin") return now.frame.dt;
        return std::nullopt;
    }

    // Whether newborn differ in the velocity that they take from the source; where not, all take the same.
    bool source_v_varies() const { return inherit != 0 && !source_.values().v().is_uniform(); }
    bool inherits_each() const { return source_v_varies() || (inherit != 0 && source_.moves()); }
    Vec3d inherited_by_all() const
    {
        if (inherit == 0 || source_v_varies()) return Vec3d::Zero();
        return inherit * source_.values().v()[0].cast<double>();
    }
    bool turns() const { return spread > 0 && (speed != 0 || velocity != Vec3d::Zero()); }
    bool own_velocity() const { return turns() || speed != 0 || inherits_each(); }

    void check_age() const;
    void move(const Simulation& simulation, const Evaluation& now);
    void bear(Flow& flow, const Births& births, const Evaluation& now);
    bool joins_group(const Evaluation& now) const { return !joins.empty() && now.keeps_group(joins); }
    void make_columns(PointSet& points, const Evaluation& now) const;
    void append(PointSet& points, std::size_t n, const Evaluation& now) const;
    Newborn newborn_of(PointSet& points, std::size_t n, const Evaluation& now) const;
    void fill(const Newborn& newborn, const Births& births, std::size_t begin, std::span<Birthplace> places,
              const Evaluation& now) const;

    struct Block;
    void draw_ages(Block& block, const Births& births, std::size_t begin, const Evaluation& now) const;
    void write_velocities(const Block& block, std::span<Vec3f> v) const;

    BirthClock clock_;
    bool at_beginning_ = false;   // of an interval: see BirthSource::Moved
    mutable BirthSource source_;  // made from `source` and `from` when they change
};
RAPID_NODE(Emit);

// The time for which a newborn is advanced in its first frame; the initial state is not.
double frame_length(const Evaluation& now) { return now.at_start ? 0 : now.frame.dt; }

// The source's own ages.
void Emit::check_age() const
{
    if (!age || age->attribute.empty()) return;
    const AnyColumn* column = source_.values().find(age->attribute);
    const auto* ages = column ? std::get_if<Column<float>>(column) : nullptr;
    if (!ages) {
        const std::string near = did_you_mean(age->attribute, source_.values().column_names());
        throw Error(fmt::format("age = rapid.attr \"{}\": the source has no float of that name{}", age->attribute,
                                near.empty() ? "; give the source one, or a number" : near));
    }
    for (std::size_t i = 0; i < ages->size(); ++i)
        if (!((*ages)[i] >= 0) || std::isinf((*ages)[i]))
            throw Error(fmt::format("age = rapid.attr \"{}\": the source's point {} has {}; ages are at least 0",
                                    age->attribute, i, (*ages)[i]));
}

void Emit::move(const Simulation& simulation, const Evaluation& now)
{
    PathOptions options;
    options.kind = motion == "spline"   ? PathOptions::Spline
                   : motion == "linear" ? PathOptions::Linear
                                        : PathOptions::None;
    options.alpha = alpha;
    if (cut) options.cuts = cut->frames;
    const auto frame = static_cast<std::int64_t>(std::ceil(now.frame.number));
    const BirthSource::Moved moved = source_.go_to(simulation.clock(), simulation.clock().step_at(now.frame), options);
    at_beginning_ = moved.at_beginning;
    if (moved.jump)
        now.warnings.push_back(
            fmt::format("{}:{}: node \"{}\": the source {}; nothing is born on the way (cut = {{{}}} says so, cut = "
                        "{{}} that it is "
                        "no jump)",
                        now.location.file, now.location.line, now.node, describe(*moved.jump, frame), frame));
}

void Emit::bear(Flow& flow, const Births& births, const Evaluation& now)
{
    PointSet& points = flow.points;
    make_columns(points, now);
    const std::size_t n = source_.empty()          ? 0
                          : flow.simulation->trial ? std::min(births.count, tried_births)
                                                   : births.count;
    if (n == 0) return;

    append(points, n, now);
    const Newborn newborn = newborn_of(points, n, now);
    for_each_chunk(n, [&](std::size_t chunk_begin, std::size_t chunk_end) {
        std::array<Birthplace, block_size> places;
        for (std::size_t begin = chunk_begin; begin < chunk_end; begin += block_size)
            fill(newborn, births, begin, std::span(places).first(std::min(block_size, chunk_end - begin)), now);
    });
    std::iota(newborn.id.begin(), newborn.id.end(), flow.simulation->next_id);
    flow.simulation->next_id += static_cast<std::int64_t>(n);
    now.figures.born += n;
}

// Whether anything is born or not: all frames have the same columns.
void Emit::make_columns(PointSet& points, const Evaluation& now) const
{
    for (const AttributeSpec& spec : made())
        if (now.keeps(spec.name)) points.add(spec);
    if (life && may_end())
        for (const char* name : {"age", "life"})
            if (now.keeps(name)) points.add(*known_attribute(name));
    if (joins_group(now)) points.group(joins);

    const std::optional<double> L = same_age(now);
    const bool all_whole_frames = L && *L >= frame_length(now);
    if (!now.at_start && !all_whole_frames) points.add({"dt", static_cast<float>(now.frame.dt)});
}

// What all newborn have in common goes into its column as one value, and a uniform column stays uniform.
void Emit::append(PointSet& points, std::size_t n, const Evaluation& now) const
{
    std::vector<AttributeSpec> common;
    for (const auto& [name, value] : attributes) common.push_back({name, value});
    for (const std::string& name : carried())
        std::visit(
            [&](const auto& column) {
                if (column.is_uniform()) common.push_back({name, column[0]});
            },
            *source_.values().find(name));
    if (!own_velocity()) {
        common.push_back({"v", Vec3f((velocity + inherited_by_all()).cast<float>())});
    }
    if (life && life->is_single()) common.push_back({"life", static_cast<float>(life->min)});
    if (const std::optional<double> L = same_age(now)) {
        const double gamma = std::min(*L, frame_length(now));
        common.push_back({"dt", static_cast<float>(gamma)});
        common.push_back({"age", static_cast<float>(*L - gamma)});
        common.push_back({"birthtime", static_cast<float>(now.frame.time - *L)});
    } else if (!age) {
        common.push_back({"age", 0.0f});
    }
    points.append(n, common, joins_group(now) ? std::vector{joins} : std::vector<std::string>());
}

// The values of all points, one each; in parallel, as they are many more than are born.
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

Newborn Emit::newborn_of(PointSet& points, std::size_t n, const Evaluation& now) const
{
    const auto floats = [&](const char* name, bool own) {
        Column<float>* column = own ? points.find<float>(name) : nullptr;
        return column ? expanded(*column).last(n) : std::span<float>();
    };
    const bool own_age = !same_age(now);
    Newborn newborn;
    newborn.P = points.P().write().last(n);
    newborn.id = points.id().write().last(n);
    if (own_velocity()) newborn.v = points.v().write().last(n);
    newborn.dt = floats("dt", own_age);
    newborn.age = floats("age", own_age && age);
    newborn.birthtime = floats("birthtime", own_age);
    newborn.life = floats("life", life && !life->is_single());
    for (const std::string& name : carried())
        std::visit(
            [&](const auto& column) {
                if (!now.keeps(name)) return;
                using T = std::decay_t<decltype(column[0])>;
                if (column.is_uniform()) return;
                newborn.carry.push_back([this, values = column.read(), to = points.column<T>(name).write().last(n)](
                                            std::size_t begin, std::span<const Birthplace> places) {
                    for (std::size_t i = 0; i < places.size(); ++i) to[begin + i] = source_.value(values, places[i]);
                });
            },
            *source_.values().find(name));
    return newborn;
}

// Some births, column by column.
struct Emit::Block {
    std::span<Birthplace> places;
    std::array<std::array<double, 4>, block_size> u;  // their numbers, where any are drawn
    std::array<double, block_size> L;                 // s, age at the frame's end
    std::array<Vec3d, block_size> carried;            // m/s, velocity of their places on a moving source

    std::size_t size() const { return places.size(); }
};

void Emit::fill(const Newborn& newborn, const Births& births, std::size_t begin, std::span<Birthplace> places,
                const Evaluation& now) const
{
    Block block;
    block.places = places;
    const bool own_age = !same_age(now);
    if (own_age || turns() || !newborn.life.empty())
        uniform4(now.random, births.first + begin, draw_use, std::span(block.u).first(block.size()));
    source_.place(now.random, births.first + begin, /*in_order=*/!rate, places);
    for (const auto& carry : newborn.carry) carry(begin, places);

    if (own_age || source_.moves()) draw_ages(block, births, begin, now);
    if (own_age) {
        const double h = frame_length(now);
        for (std::size_t j = 0; j < block.size(); ++j) {
            const double gamma = std::min(block.L[j], h);
            if (!newborn.dt.empty()) newborn.dt[begin + j] = static_cast<float>(gamma);
            if (!newborn.age.empty()) newborn.age[begin + j] = static_cast<float>(block.L[j] - gamma);
            if (!newborn.birthtime.empty())
                newborn.birthtime[begin + j] = static_cast<float>(now.frame.time - block.L[j]);
        }
    }
    if (source_.moves()) {
        std::array<double, block_size> t;
        for (std::size_t j = 0; j < block.size(); ++j)
            t[j] = at_beginning_ ? 0 : std::max(0.0, 1 - block.L[j] / now.frame.dt);
        source_.path().carry(std::span(t).first(block.size()), speed != 0, places,
                             std::span(block.carried).first(block.size()));
        for (std::size_t j = 0; j < block.size(); ++j) block.carried[j] /= now.frame.dt;
    }
    for (std::size_t j = 0; j < block.size(); ++j) newborn.P[begin + j] = places[j].P;
    if (!newborn.life.empty())
        for (std::size_t j = 0; j < block.size(); ++j)
            newborn.life[begin + j] = static_cast<float>(life->at(block.u[j][life_draw]));
    if (!newborn.v.empty()) write_velocities(block, newborn.v.subspan(begin, block.size()));
}

void Emit::draw_ages(Block& block, const Births& births, std::size_t begin, const Evaluation& now) const
{
    const double h = frame_length(now);
    const std::optional<double> same = same_age(now);
    const AnyColumn* own = age && !age->attribute.empty() ? source_.values().find(age->attribute) : nullptr;
    for (std::size_t j = 0; j < block.size(); ++j) {
        double& L = block.L[j];
        if (same)
            L = *same;
        else if (own)
            L = static_cast<double>(source_.value(std::get<Column<float>>(*own).read(), block.places[j]));
        else if (age)
            L = age->interval.at(block.u[j][age_draw]);
        else
            L = birth == "even" ? births.even_age(begin + j) : h * block.u[j][age_draw];
    }
}

void Emit::write_velocities(const Block& block, std::span<Vec3f> v) const
{
    const bool turned = turns(), source_v_differs = source_v_varies(), carried = inherit != 0 && source_.moves();
    const Cone cone(spread);
    const Strided<Vec3f> source_v = source_.values().v().read();
    const Vec3d common = inherited_by_all();
    for (std::size_t j = 0; j < block.size(); ++j) {
        const Birthplace& place = block.places[j];
        const Vec3d mean = velocity + speed * place.N.cast<double>();
        const auto& u = block.u[j];
        Vec3d sum = common + (turned ? cone.turn(mean, u[cone_draw], u[turn_draw]) : mean);
        if (source_v_differs) sum += inherit * source_.value(source_v, place).cast<double>();
        if (carried) sum += inherit * block.carried[j];
        v[j] = sum.cast<float>();
    }
}

}  // namespace
}  // namespace rapid

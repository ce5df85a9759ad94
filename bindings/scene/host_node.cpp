// Nodes whose callback in the program processes arrays of points.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>

#include "bindings/scene/host_object.h"
#include "bindings/scene/scene_error.h"
#include "include/rapid/offers.h"
#include "runtime/graph/evaluation.h"
#include "runtime/graph/plugin.h"
#include "runtime/points/members.h"
#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/rows.h"
#include "runtime/solver/dynamics.h"

namespace rapid {

// values: of the node's parameters. Returns null if there are no rods. Throws the callback's exception, or Error if a
// rod has wrong numbers or unknown points.
std::shared_ptr<const Constraint> rods_of(const HostNode& node, const std::vector<double>& values,
                                          const std::string& group, const PointSet& points, const Evaluation& now);

namespace {

// C = |P_a - P_b| - length
struct Rod {
    static constexpr int points = 2;

    double length;  // m

    double residual(const std::array<Vec3d, 2>& P, std::array<Vec3d, 2>& gradient) const
    {
        const Vec3d d = P[0] - P[1];
        const double distance = d.norm();
        // Coincident points may be separated in any direction.
        gradient[0] = distance > 0 ? Vec3d(d / distance) : Vec3d(Vec3d::UnitY());
        gradient[1] = -gradient[0];
        return distance - length;
    }

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(length);
    }
};

void check(const HostRod& rod, const std::vector<std::int64_t>& ids, const std::string& node)
{
    const auto is_there = [&](std::int64_t id) { return std::binary_search(ids.begin(), ids.end(), id); };
    if (!is_there(rod.a) || !is_there(rod.b) || rod.a == rod.b)
        throw Error(fmt::format(
            "the program's node \"{}\" returns a rod between the ids {} and {}; they must belong to two points", node,
            rod.a, rod.b));
    if (!(rod.length >= 0 && std::isfinite(rod.length) && rod.compliance >= 0 && std::isfinite(rod.compliance)))
        throw Error(
            fmt::format("the program's node \"{}\" returns a rod of length {} and compliance {}; both must be finite "
                        "and at least 0",
                        node, rod.length, rod.compliance));
}

}  // namespace

std::shared_ptr<const Constraint> rods_of(const HostNode& node, const std::vector<double>& values,
                                          const std::string& group, const PointSet& points, const Evaluation& now)
{
    std::vector<std::int64_t> ids(points.size());
    std::vector<Vec3d> P(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        ids[i] = points.id()[i];
        P[i] = points.P()[i].cast<double>();
    }
    std::vector<HostRod> rods;
    HostCall call;
    call.count = points.size();
    call.frame = now.frame.number;
    call.time = now.frame.time;
    call.dt = now.frame.dt;
    call.parameters = values.data();
    call.id = ids.data();
    call.P = P.empty() ? nullptr : P.front().data();
    call.rods = &rods;
    if (!points.empty()) call_program(fmt::format("node \"{}\"", node.name).c_str(), node.call, call);

    std::sort(ids.begin(), ids.end());
    auto rows = std::make_shared<Rows<Rod>>();
    for (const HostRod& rod : rods) {
        check(rod, ids, node.name);
        rows->add({rod.a, rod.b}, Rod{rod.length}, rod.compliance);
    }
    if (rods.empty()) return nullptr;
    return constrain(now, group, [rows](const PointSet&) { return rows; });
}

namespace {

using DeclaredNode = std::shared_ptr<const HostNode>;

// The arguments of a node as numbers; a vector is three.
struct HostFields {
    std::vector<double> values;
    std::string group;
};

std::size_t width_of(ColumnType type) { return type == ColumnType::Vec3 ? 3 : 1; }

// A column that the callback reads or writes, from a point on: the column's own memory if it is an array.
class ReadColumn {
public:
    ReadColumn(const PointSet& points, const std::string& name, std::size_t first, std::size_t count)
    {
        std::visit(
            [&](const auto& column) {
                using T = std::decay_t<decltype(column[0])>;
                if constexpr (std::is_same_v<T, float> || std::is_same_v<T, Vec3f>) {
                    const Strided<T> values = column.read();
                    if (values.stride == 1) {
                        data_ = reinterpret_cast<const float*>(values.data + first);
                        return;
                    }
                    constexpr std::size_t width = sizeof(T) / sizeof(float);
                    const auto* one = reinterpret_cast<const float*>(values.data);
                    expanded_.reserve(count * width);
                    for (std::size_t i = 0; i < count; ++i) expanded_.insert(expanded_.end(), one, one + width);
                    data_ = expanded_.data();
                }
            },
            *points.find(name));
    }
    const float* data() const { return data_; }

private:
    const float* data_ = nullptr;
    std::vector<float> expanded_;
};

std::string title_of(const HostNode& node) { return fmt::format("node \"{}\"", node.name); }

class HostForce final : public rapid::Force {
public:
    HostForce(DeclaredNode declared, HostFields fields, const Frame& frame, bool guarded)
        : declared_(std::move(declared)), fields_(std::move(fields)), frame_(frame), guarded_(guarded)
    {
    }

    void contribute(const Chunk& chunk, Forces& forces) const override
    {
        if (chunk.size() == 0) return;
        GuardedArray<double> acceleration(3 * chunk.size(), guarded_);
        std::vector<ReadColumn> columns;
        std::vector<const float*> reads;
        for (const auto& [name, type] : declared_->reads)
            columns.emplace_back(chunk.points, name, chunk.first, chunk.size());
        for (const ReadColumn& column : columns) reads.push_back(column.data());
        HostCall call;
        call.count = chunk.size();
        call.frame = frame_.number;
        call.time = chunk.time[0];
        call.dt = frame_.dt;
        call.parameters = fields_.values.data();
        call.P = chunk.P.front().data();
        call.v = chunk.v.front().data();
        call.acceleration = acceleration.data();
        call.reads = reads.data();
        call_program(title_of(*declared_).c_str(), declared_->call, call);
        acceleration.check("the acceleration of the program's " + title_of(*declared_), 3);
        const std::span<Vec3d> to = forces.accelerations();
        for (std::size_t i = 0; i < chunk.size(); ++i)
            to[i] += Vec3d(acceleration[3 * i], acceleration[3 * i + 1], acceleration[3 * i + 2]);
    }

private:
    const DeclaredNode declared_;
    const HostFields fields_;
    const Frame frame_;
    const bool guarded_;
};

// The points of an edit: all of its group.
class Edit {
public:
    Edit(const HostNode& node, const HostFields& fields, const Evaluation& now, bool guarded)
        : node_(node), fields_(fields), now_(now), guarded_(guarded)
    {
    }

    void run(PointSet& points) const
    {
        if (fields_.group.empty()) {
            const std::vector<std::uint8_t> keep = call(points);
            remove(points, keep);
            return;
        }
        const Strided<std::uint8_t> members = members_of(points, fields_.group);
        std::vector<std::uint32_t> indices;
        for (std::size_t i = 0; i < points.size(); ++i)
            if (members[i]) indices.push_back(static_cast<std::uint32_t>(i));
        if (indices.empty()) return;
        PointSet some = points.select(indices);
        const std::vector<std::uint8_t> keep_some = call(some);
        points.put(indices, some);
        std::vector<std::uint8_t> keep(points.size(), 1);
        for (std::size_t k = 0; k < indices.size(); ++k) keep[indices[k]] = keep_some[k];
        remove(points, keep);
    }

private:
    // Returns 1 for each point that stays.
    std::vector<std::uint8_t> call(PointSet& points) const
    {
        const std::size_t count = points.size();
        std::vector<std::uint8_t> keep(count, 1);
        if (count == 0) return keep;
        std::vector<ReadColumn> read;
        std::vector<const float*> reads;
        for (const auto& [name, type] : node_.reads) read.emplace_back(points, name, 0, count);
        for (const ReadColumn& column : read) reads.push_back(column.data());
        std::vector<GuardedArray<float>> written;
        std::vector<float*> writes;
        for (const auto& [name, type] : node_.writes) {
            const std::size_t size = count * width_of(type);
            const ReadColumn before(points, name, 0, count);
            written.emplace_back(size, guarded_);
            std::memcpy(written.back().data(), before.data(), size * sizeof(float));
        }
        for (GuardedArray<float>& array : written) writes.push_back(array.data());
        GuardedArray<std::uint8_t> kill(count, guarded_);

        HostCall arguments;
        arguments.count = count;
        arguments.frame = now_.frame.number;
        arguments.time = now_.frame.time;
        arguments.dt = now_.frame.dt;
        arguments.parameters = fields_.values.data();
        arguments.reads = reads.data();
        arguments.writes = writes.data();
        arguments.kill = kill.data();
        call_program(title_of(node_).c_str(), node_.call, arguments);

        kill.check(fmt::format("what the program's {} kills", title_of(node_)), 1);
        for (std::size_t k = 0; k < written.size(); ++k) {
            const auto& [name, type] = node_.writes[k];
            written[k].check(fmt::format("{} of the program's {}", name, title_of(node_)), width_of(type));
            put(points, name, written[k].data());
        }
        for (std::size_t i = 0; i < count; ++i) keep[i] = kill[i] == 0;
        return keep;
    }

    static void put(PointSet& points, const std::string& name, const float* values)
    {
        std::visit(
            [&](auto& column) {
                using T = std::decay_t<decltype(column[0])>;
                if constexpr (std::is_same_v<T, float> || std::is_same_v<T, Vec3f>) {
                    const std::span<T> to = column.overwrite();
                    std::memcpy(static_cast<void*>(to.data()), values, to.size_bytes());
                }
            },
            *points.find(name));
    }

    void remove(PointSet& points, const std::vector<std::uint8_t>& keep) const
    {
        const std::size_t before = points.size();
        if (std::find(keep.begin(), keep.end(), 0) != keep.end()) points.keep(keep);
        now_.figures.died += before - points.size();
    }

    const HostNode& node_;
    const HostFields& fields_;
    const Evaluation& now_;
    const bool guarded_;
};

class HostOperator final : public Operator {
public:
    HostOperator(DeclaredNode declared, bool guarded) : declared_(std::move(declared)), guarded_(guarded)
    {
        for (const HostParameter& parameter : declared_->parameters)
            fields_.values.resize(fields_.values.size() + (parameter.fallback.index() == 0 ? 1 : 3));
    }

    void* fields() override { return &fields_; }
    Flow evaluate(std::span<Flow> inputs, const Evaluation& now) override
    {
        if (declared_->kind == HostNode::Constraint) {
            auto rods = rods_of(*declared_, fields_.values, fields_.group, inputs[0].points, now);
            if (rods) inputs[0].dynamics.add(std::move(rods));
        } else if (declared_->kind == HostNode::Force) {
            inputs[0].dynamics.add(std::shared_ptr<const Force>(
                dynamic_of<HostForce>(now, fields_.group, declared_, fields_, now.frame, guarded_)));
        } else {
            Edit(*declared_, fields_, now, guarded_).run(inputs[0].points);
        }
        return std::move(inputs[0]);
    }
    Flow start(std::span<Flow> inputs, const Evaluation&) override { return std::move(inputs[0]); }
    void uses(Uses& uses) const override
    {
        if (!fields_.group.empty()) uses.reads_groups.push_back(fields_.group);
    }
    void check() const override {}

private:
    const DeclaredNode declared_;
    const bool guarded_;
    HostFields fields_;
};

Param param_of(const HostParameter& declared, std::size_t slot)
{
    Param param;
    param.name = declared.name;
    param.doc = declared.doc;
    param.unit = declared.unit;
    if (const double* number = std::get_if<double>(&declared.fallback)) {
        param.type = "number";
        param.fallback = *number;
        param.range = Range{declared.min, declared.max};
        param.assign = [slot](const Param& self, void* fields, const Value& value) {
            read_value(self, value, static_cast<HostFields*>(fields)->values[slot]);
        };
        return param;
    }
    const auto& [x, y, z] = std::get<std::array<double, 3>>(declared.fallback);
    param.type = "vec3";
    param.fallback = Vec3d(x, y, z);
    param.assign = [slot](const Param& self, void* fields, const Value& value) {
        Vec3d vector;
        read_value(self, value, vector);
        std::copy_n(vector.data(), 3, &static_cast<HostFields*>(fields)->values[slot]);
    };
    return param;
}

bool is_name(const std::string& text)
{
    const auto is_word = [](unsigned char c) { return std::isalnum(c) || c == '_'; };
    return !text.empty() && !std::isdigit(static_cast<unsigned char>(text[0])) &&
           std::all_of(text.begin(), text.end(), is_word);
}

// Declares that the node makes a column that it reads or writes, unless something else does.
void declare_column(NodeType& type, const HostNode& node, const std::string& name, ColumnType of, bool written)
{
    if (of != ColumnType::Float && of != ColumnType::Vec3)
        throw Error(fmt::format("{}: columns of callbacks must be Float or Vec3", name));
    if (node.kind == HostNode::Force && (name == "P" || name == "v"))
        throw Error(fmt::format("{}: a force always has P and v; remove it from the columns", name));
    const AttributeSpec* known = known_attribute(name);
    const AttributeValue zero = of == ColumnType::Float ? AttributeValue(0.0f) : AttributeValue(Vec3f(Vec3f::Zero()));
    const bool own = name == "P" || name == "v";
    if ((own && of != ColumnType::Vec3) || (known && known->fallback.index() != zero.index()) || name == "id")
        throw Error(fmt::format("{} has another type", name));
    if (!own && !known) type.uses.makes.push_back({name, zero});
    (written ? type.uses.writes : type.uses.reads).push_back(name);
    if (written && !own) type.uses.reads.push_back(name);
}

}  // namespace

NodeType make_type(const HostNode& node, bool guarded)
try {
    if (!is_name(node.name)) throw Error("its name must be a word of letters, digits and _");
    if (!node.call) throw Error("it has no function to call");
    if (node.kind == HostNode::Force && !node.writes.empty())
        throw Error("a force can't write columns; it returns accelerations");
    if (node.kind == HostNode::Constraint && !(node.reads.empty() && node.writes.empty()))
        throw Error("a constraint can't read or write columns; it returns rods");
    NodeType type;
    type.name = node.name;
    type.doc = node.doc;
    type.kind = node.kind == HostNode::Edit ? NodeKind::Points : NodeKind::Dynamic;
    if (node.kind == HostNode::Force) type.stages = {Stage::Forces};
    if (node.kind == HostNode::Constraint) {
        type.stages = {Stage::Constraints};
        type.uses.takes.push_back("mass");
    }
    type.varies = node.kind == HostNode::Edit;
    type.params.push_back(param_of(&HostFields::group, "group", Value(), any_number(), "",
                                   "limits the node to the points of this group"));
    std::size_t slot = 0;
    for (const HostParameter& parameter : node.parameters) {
        if (!is_name(parameter.name) || type.find(parameter.name) || parameter.name == "name")
            throw Error(
                fmt::format("parameter \"{}\": the name must consist of letters, digits and _, and must be unique",
                            parameter.name));
        type.params.push_back(param_of(parameter, slot));
        slot += parameter.fallback.index() == 0 ? 1 : 3;
    }
    for (const auto& [name, of] : node.reads) declare_column(type, node, name, of, false);
    for (const auto& [name, of] : node.writes) declare_column(type, node, name, of, true);
    type.make = [declared = std::make_shared<const HostNode>(node), guarded] {
        return std::make_unique<HostOperator>(declared, guarded);
    };
    return type;
} catch (const Error& error) {
    throw Error(fmt::format("the program's node \"{}\": {}", node.name, error.message()), error.kind());
}

}  // namespace rapid

#include "runtime/graph/attribute_uses.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "runtime/base/at_node.h"
#include "runtime/base/error.h"
#include "runtime/graph/point_function.h"
#include "runtime/points/attribute_like.h"
#include "runtime/points/point_names.h"

namespace rapid {
namespace {

constexpr std::size_t word_bits = 64;

// Adds all names. Returns true if any is new.
bool add_all(std::vector<std::uint64_t>& names, const std::vector<std::uint64_t>& others)
{
    bool grows = false;
    for (std::size_t k = 0; k < names.size(); ++k) {
        grows |= (others[k] & ~names[k]) != 0;
        names[k] |= others[k];
    }
    return grows;
}

}  // namespace

AttributeFlow::AttributeFlow(const std::vector<PlannedNode>& nodes)
{
    std::vector<std::vector<std::size_t>> made(nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i)
        for (const AttributeSpec& spec : uses_of(nodes[i]).makes)
            made[i].push_back(names_.emplace(spec.name, names_.size()).first->second);
    const Names none((names_.size() + word_bits - 1) / word_bits, 0);

    at_.assign(nodes.size(), none);
    std::map<std::size_t, Names> fed_back;  // by simulation
    // Points that a merge brings into a loop are fed back with their attributes, so names are propagated until they
    // settle.
    for (bool grows = true; grows;) {
        grows = false;
        for (std::size_t i = 0; i < nodes.size(); ++i) {
            const PlannedNode& planned = nodes[i];
            for (const std::size_t name : made[i]) at_[i][name / word_bits] |= std::uint64_t{1} << name % word_bits;
            for (const std::size_t input : planned.inputs) add_all(at_[i], at_[input]);
            Names& back = fed_back.emplace(planned.simulation, none).first->second;
            if (planned.node->type->kind == NodeKind::Source) add_all(at_[i], back);
            if (planned.node->type->kind == NodeKind::Solve) grows |= add_all(back, at_[i]);
        }
    }
}

bool AttributeFlow::has(std::size_t node, std::string_view name) const
{
    const auto known = names_.find(name);
    return known != names_.end() && (at_[node][known->second / word_bits] >> known->second % word_bits & 1) != 0;
}

std::vector<std::string> AttributeFlow::names_at(std::size_t node) const
{
    std::vector<std::string> names;
    for (const auto& [name, bit] : names_)
        if (has(node, name)) names.push_back(name);
    return names;
}

namespace {

// Returns the first location at which a function of the node names the attribute; line 0 if none does.
Location location_of(const Node& node, const std::string& attribute)
{
    for (const auto& [param, value] : node.arguments) {
        const ObjectPtr* object = value.get<ObjectPtr>();
        const auto* function = object ? dynamic_cast<const AttributeLocations*>(object->get()) : nullptr;
        if (!function) continue;
        if (const Location place = function->location_of(attribute); place.line > 0) return place;
    }
    return {};
}

// Returns the number of components of the attribute that the node reads or assigns; 1 if unknown.
int component_count(const Node& node, const std::string& attribute)
{
    for (const auto& [name, value] : node.arguments) {
        const auto* reference = value.get<AttributeRef>();
        const Param* param = reference && reference->name == attribute ? node.type->find(name) : nullptr;
        if (param && param->type == "vec3") return 3;
        const ObjectPtr* object = value.get<ObjectPtr>();
        const auto* function = object ? dynamic_cast<const AttributeLocations*>(object->get()) : nullptr;
        if (const int numbers = function ? function->numbers_of(attribute) : 0; numbers > 0) return numbers;
    }
    return 1;
}

// Runs check() and locates its Errors at the line inside a function of the node that names the attribute.
template <class F>
void at_mention(const Node& node, const std::string& attribute, const F& check)
{
    try {
        check();
    } catch (Error& error) {
        if (const Location place = location_of(node, attribute); place.line > 0) error.at(place);
        throw;
    }
}

// The names that the nodes of one simulation make.
struct MadeNames {
    struct Maker {
        AttributeSpec spec;
        const Node* node;
    };
    std::map<std::string, Maker> attributes;
    std::set<std::string> groups;

    // Throws Error if an earlier node makes the attribute with another type.
    void add(const Uses& uses, const Node& node)
    {
        groups.insert(uses.makes_groups.begin(), uses.makes_groups.end());
        for (const AttributeSpec& spec : uses.makes) {
            const auto [other, fresh] = attributes.emplace(spec.name, Maker{spec, &node});
            if (!fresh && type_of(other->second.spec.fallback) != type_of(spec.fallback))
                throw Error(fmt::format("makes attribute \"{}\" as {}, but node \"{}\" at line {} makes it as {}",
                                        spec.name, type_name(type_of(spec.fallback)), other->second.node->name,
                                        other->second.node->location.line,
                                        type_name(type_of(other->second.spec.fallback))));
        }
    }

    void check_attribute(const std::string& name, int numbers) const
    {
        if (is_own_column(name) || attributes.count(name) || known_attribute(name)) return;
        std::vector<std::string> names = point_names_of(PointName::OwnColumn);
        for (const auto& [made, maker] : attributes) names.push_back(made);
        for (const AttributeSpec& known : known_attributes()) names.push_back(known.name);
        throw Error(no_attribute(name, names, numbers));
    }

    void check_group(const std::string& name) const
    {
        if (groups.count(name)) return;
        throw Error(fmt::format("no node makes a group \"{}\"{}", name,
                                did_you_mean(name, std::vector<std::string>(groups.begin(), groups.end()))));
    }
};

void add_once(std::vector<std::size_t>& nodes, std::size_t node)
{
    if (nodes.empty() || nodes.back() != node) nodes.push_back(node);
}

void sort_unique(std::vector<std::size_t>& nodes)
{
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
}

// Collects the users of each name. A node makes a name for the points of its simulation, which keep it when they are
// merged into another. A node reads it from all simulations whose points reach it.
class UseCollector {
public:
    UseCollector(const std::vector<PlannedNode>& nodes, std::size_t simulation) : nodes_(nodes), simulation_(simulation)
    {
        for (const PlannedNode& planned : nodes)
            if (planned.simulation == simulation) sources_.insert(planned.carries.begin(), planned.carries.end());

        entry({"P", Vec3f(Vec3f::Zero())}).always = true;
        entry({"v", Vec3f(Vec3f::Zero())}).always = true;
        entry({"id", std::int64_t{0}}).always = true;
        entry({"dt", 0.0f});
        for (const AttributeSpec& known : known_attributes()) entry(known);
    }

    std::map<std::string, PlannedAttribute> collect()
    {
        std::vector<std::pair<std::size_t, Uses>> users;
        for (std::size_t i = 0; i < nodes_.size(); ++i)
            if (is_relevant(nodes_[i])) users.emplace_back(i, uses_of(nodes_[i]));
        for (const auto& [i, uses] : users)
            if (is_among_points(nodes_[i])) add_maker(i, uses);
        for (const auto& [i, uses] : users) {
            if (is_among_points(nodes_[i])) add_writer(i, uses);
            if (reads_source_here(nodes_[i])) add_reader_of_source(i, uses);
            if (nodes_[i].carries.count(simulation_)) add_reader(i, uses);
        }
        resolve_conditional_uses();
        add_readers_of_age();
        for (auto& [name, attribute] : found_)
            for (auto* list : {&attribute.made_by, &attribute.written_by, &attribute.read_by}) sort_unique(*list);
        return std::move(found_);
    }

private:
    PlannedAttribute& entry(const AttributeSpec& spec)
    {
        PlannedAttribute& attribute = found_[spec.name];
        if (attribute.name.empty()) attribute.name = spec.name, attribute.spec = spec;
        return attribute;
    }

    PlannedAttribute& group_entry(const std::string& name)
    {
        PlannedAttribute& attribute = found_[group_prefix + name];
        attribute.name = group_prefix + name;
        attribute.group = true;
        return attribute;
    }

    bool reads_source_here(const PlannedNode& planned) const
    {
        return std::any_of(planned.sources.begin(), planned.sources.end(),
                           [&](std::size_t source) { return nodes_[source].carries.count(simulation_) > 0; });
    }

    bool is_among_points(const PlannedNode& planned) const
    {
        return planned.carries.count(simulation_) || sources_.count(planned.simulation);
    }
    bool is_relevant(const PlannedNode& planned) const
    {
        return is_among_points(planned) || reads_source_here(planned);
    }

    void add_maker(std::size_t node, const Uses& uses)
    {
        for (const AttributeSpec& spec : uses.makes) add_once(entry(spec).made_by, node);
        for (const std::string& name : uses.makes_groups) add_once(group_entry(name).made_by, node);
        for (const std::string& name : uses.joins_groups) add_once(group_entry(name).written_by, node);
    }

    void add_writer(std::size_t node, const Uses& uses)
    {
        for (const std::string& name : uses.writes)
            if (const auto at = found_.find(name); at != found_.end()) add_once(at->second.written_by, node);
        for (const std::string& name : uses.gives) add_once(providers_[name], node);
    }

    void add_reader(std::size_t node, const Uses& uses)
    {
        for (const auto* list : {&uses.reads, &uses.may})
            for (const std::string& name : *list)
                if (const auto at = found_.find(name); at != found_.end()) add_once(at->second.read_by, node);
        for (const auto* list : {&uses.reads_groups, &uses.takes_groups})
            for (const std::string& name : *list) add_once(consumers_[group_prefix + name], node);
        for (const std::string& name : uses.takes) add_once(consumers_[name], node);
        if (uses.reads_all) readers_of_all_.push_back(node);
    }

    void add_reader_of_source(std::size_t node, const Uses& uses)
    {
        for (const std::string& name : uses.reads_of_source)
            if (const auto at = found_.find(name); at != found_.end()) add_once(at->second.read_by, node);
        for (const std::string& name : uses.reads_of_source) add_once(consumers_[name], node);
        for (const std::string& name : uses.takes_of_source) add_once(consumers_[name], node);
        for (const std::string& name : uses.reads_groups_of_source) add_once(consumers_[group_prefix + name], node);
    }

    // Resolves attributes that are written if something reads them, and read if something else makes them.
    void resolve_conditional_uses()
    {
        for (auto& [name, attribute] : found_) {
            const bool given = providers_.count(name) && consumers_.count(name);
            if (given)
                attribute.written_by.insert(attribute.written_by.end(), providers_[name].begin(),
                                            providers_[name].end());
            if (!attribute.is_of_scene()) continue;
            for (const std::size_t taker : consumers_[name]) add_once(attribute.read_by, taker);
            if (!attribute.made_by.empty())
                attribute.read_by.insert(attribute.read_by.end(), readers_of_all_.begin(), readers_of_all_.end());
        }
    }

    // Solve compares age with life if points are mortal.
    void add_readers_of_age()
    {
        const PlannedAttribute& life = found_.at("life");
        if (life.made_by.empty() && life.written_by.empty()) return;
        for (const std::size_t reader : life.read_by) add_once(found_.at("age").read_by, reader);
    }

    const std::vector<PlannedNode>& nodes_;
    const std::size_t simulation_;
    std::set<std::size_t> sources_;  // simulations whose points are merged into this one
    std::map<std::string, PlannedAttribute> found_;
    std::map<std::string, std::vector<std::size_t>> consumers_, providers_;  // nodes of Uses::takes and Uses::gives
    std::vector<std::size_t> readers_of_all_;
};

// Checks the names that nodes read from the points of this simulation as their source.
void check_names_of_sources(const std::vector<PlannedNode>& nodes, std::size_t simulation, const MadeNames& made)
{
    for (const PlannedNode& planned : nodes)
        for (const std::size_t source : planned.sources) {
            if (nodes[source].simulation != simulation || nodes[source].carries.size() > 1) continue;
            name_errors(planned.node->name, planned.node->location, [&] {
                const Uses uses = uses_of(planned);
                for (const std::string& name : uses.reads_of_source)
                    at_mention(*planned.node, name,
                               [&] { made.check_attribute(name, component_count(*planned.node, name)); });
                for (const std::string& name : uses.reads_groups_of_source) made.check_group(name);
            });
        }
}

// Throws Error if no node makes the attribute, or only nodes after this one do.
void check_attribute(const MadeNames& made, const AttributeFlow& flow, const std::vector<PlannedNode>& nodes,
                     std::size_t node, const std::string& name)
{
    // Points of other simulations, which come through a merge, may have other names.
    const int numbers = component_count(*nodes[node].node, name);
    if (nodes[node].carries.size() == 1) made.check_attribute(name, numbers);
    if (flow.has(node, name) || is_own_column(name) || known_attribute(name)) return;
    if (const auto later = made.attributes.find(name); later != made.attributes.end())
        throw Error(
            fmt::format("no attribute \"{}\" here; node \"{}\" at line {} makes it, but comes later: move that node "
                        "before this one",
                        name, later->second.node->name, later->second.node->location.line));
    throw Error(no_attribute(name, flow.names_at(node), numbers));
}

}  // namespace

void check_names(const std::vector<PlannedNode>& nodes, const AttributeFlow& flow, std::size_t simulation)
{
    MadeNames made;
    for (const PlannedNode& planned : nodes)
        if (planned.simulation == simulation)
            name_errors(planned.node->name, planned.node->location, [&] { made.add(uses_of(planned), *planned.node); });
    check_names_of_sources(nodes, simulation, made);

    for (std::size_t i = 0; i < nodes.size(); ++i) {
        const PlannedNode& planned = nodes[i];
        if (planned.simulation != simulation) continue;
        name_errors(planned.node->name, planned.node->location, [&] {
            const Uses uses = uses_of(planned);
            for (const auto* list : {&uses.reads, &uses.writes})
                for (const std::string& name : *list)
                    at_mention(*planned.node, name, [&] { check_attribute(made, flow, nodes, i, name); });
            if (planned.carries.size() > 1) return;
            for (const std::string& name : uses.reads_groups) made.check_group(name);
        });
    }
}

namespace {

// Returns true if the node fails without this attribute.
bool requires_attribute(const Uses& uses, const std::string& name)
{
    const auto names = [&](const std::vector<std::string>& list) {
        return std::find(list.begin(), list.end(), name) != list.end();
    };
    return names(uses.reads) || names(uses.writes);
}

// Returns true if a node fails unless the points have this known attribute before the nodes that make it.
bool is_used_before_made(const std::vector<PlannedNode>& nodes, const AttributeFlow& flow,
                         const PlannedAttribute& attribute)
{
    const auto fails_without = [&](std::size_t user) {
        return !flow.has(user, attribute.name) && requires_attribute(uses_of(nodes[user]), attribute.name);
    };
    return known_attribute(attribute.name) && !attribute.made_by.empty() &&
           (std::any_of(attribute.read_by.begin(), attribute.read_by.end(), fails_without) ||
            std::any_of(attribute.written_by.begin(), attribute.written_by.end(), fails_without));
}

}  // namespace

std::vector<PlannedAttribute> find_attributes(const std::vector<PlannedNode>& nodes, const AttributeFlow& flow,
                                              std::size_t simulation, const PlanOptions& options)
{
    const std::set<std::string> requested(options.attributes.begin(), options.attributes.end());
    std::vector<PlannedAttribute> attributes;
    for (auto& [name, attribute] : UseCollector(nodes, simulation).collect()) {
        const std::string plain = attribute.group ? name.substr(group_prefix.size()) : name;
        attribute.requested_by_name = requested.count(plain) > 0 && name != "dt";
        attribute.requested_as_made = options.all_made && !attribute.made_by.empty();
        attribute.kept = attribute.always || !attribute.written_by.empty() || !attribute.read_by.empty() ||
                         attribute.requested_by_name || attribute.requested_as_made ||
                         (options.keep_all && name != "dt");
        attribute.used_before_made = is_used_before_made(nodes, flow, attribute);
        attributes.push_back(std::move(attribute));
    }
    return attributes;
}

void keep_for_merges(const std::vector<PlannedNode>& nodes, std::vector<PlannedSimulation>& simulations)
{
    std::vector<std::set<std::size_t>> sources(simulations.size());  // other simulations merged into each
    for (const PlannedNode& planned : nodes)
        for (std::size_t i = 1; i < planned.inputs.size(); ++i) {
            const std::set<std::size_t>& carries = nodes[planned.inputs[i]].carries;
            sources[planned.simulation].insert(carries.begin(), carries.end());
        }
    const auto keep_in = [](PlannedSimulation& simulation, const std::string& name) {
        const auto found = std::find_if(simulation.attributes.begin(), simulation.attributes.end(),
                                        [&](const PlannedAttribute& attribute) { return attribute.name == name; });
        if (found == simulation.attributes.end() || found->kept) return false;
        return found->kept = found->kept_for_merge = true;
    };
    for (bool grows = true; std::exchange(grows, false);)
        for (std::size_t into = 0; into < simulations.size(); ++into)
            for (const PlannedAttribute& attribute : simulations[into].attributes)
                for (const std::size_t from : sources[into])
                    if (attribute.kept && from != into) grows |= keep_in(simulations[from], attribute.name);
}

namespace {

// A quiet NaN whose payload survives arithmetic, so that it can be recognized in results.
constexpr std::uint32_t poison_bits = 0x7fedbeefu;
const float poison_float = std::bit_cast<float>(poison_bits);

Token poison_token()
{
    static const Token poisoned = token_of("a value that is not declared");
    return poisoned;
}

template <class T>
T poison()
{
    if constexpr (std::is_same_v<T, float>)
        return poison_float;
    else if constexpr (std::is_same_v<T, Vec3f>)
        return Vec3f::Constant(poison_float);
    else if constexpr (std::is_same_v<T, Quatf>)
        return Quatf(poison_float, poison_float, poison_float, poison_float);
    else if constexpr (std::is_same_v<T, Token>)
        return poison_token();
    else if constexpr (sizeof(T) == 1)
        return T{0xa5};
    else
        return static_cast<T>(0x5eadbeef);
}

template <class T>
bool same_bits(const T& a, const T& b)
{
    return std::memcmp(&a, &b, sizeof(T)) == 0;
}

template <class T>
void poison(Column<T>& column)
{
    column = Column<T>(column.size(), poison<T>(), column.fallback());
}

// Adds attributes and, with group_prefix, groups.
void add_names(const Uses& uses, std::set<std::string>& names)
{
    for (const auto* list : {&uses.reads, &uses.writes, &uses.may, &uses.takes, &uses.gives})
        names.insert(list->begin(), list->end());
    for (const auto* list : {&uses.makes, &uses.defaults})
        for (const AttributeSpec& spec : *list) names.insert(spec.name);
    for (const auto* list : {&uses.reads_groups, &uses.takes_groups, &uses.makes_groups, &uses.joins_groups})
        for (const std::string& name : *list) names.insert(group_prefix + name);
}

// A mask of the original points that still exist, and their number.
struct Survivors {
    std::vector<std::uint8_t> mask;
    std::size_t count = 0;
};

Survivors survivors_of(const Column<std::int64_t>& before, const Column<std::int64_t>& after)
{
    Survivors survivors{std::vector<std::uint8_t>(before.size(), 0)};
    for (std::size_t i = 0; i < before.size() && survivors.count < after.size(); ++i)
        if (before[i] == after[survivors.count]) survivors.mask[i] = 1, ++survivors.count;
    return survivors;
}

template <class T>
void restore_values(const std::string& name, const Column<T>& before, const Survivors& survivors, Column<T>& column)
{
    for (std::size_t i = 0; i < survivors.count; ++i)
        if (!same_bits(column[i], poison<T>()))
            throw Error(fmt::format("it writes \"{}\", which it does not declare", name));
    Column<T> restored = before;
    restored.set_fallback(column.fallback());
    restored.keep(Compaction::from_mask(survivors.mask));
    for (std::size_t i = survivors.count; i < column.size(); ++i) restored.append(1, column[i]);
    column = std::move(restored);
}

bool is_poisoned(const AnyColumn& any)
{
    const auto holds = [](const auto& column, const auto& poisoned) {
        for (std::size_t i = 0; i < column.size(); ++i)
            if (poisoned(column[i])) return true;
        return false;
    };
    const auto is_poison = [](float x) { return std::bit_cast<std::uint32_t>(std::abs(x)) == poison_bits; };
    if (const auto* floats = std::get_if<Column<float>>(&any)) return holds(*floats, is_poison);
    if (const auto* vectors = std::get_if<Column<Vec3f>>(&any))
        return holds(*vectors, [&](const Vec3f& x) { return is_poison(x[0]) || is_poison(x[1]) || is_poison(x[2]); });
    if (const auto* strings = std::get_if<Column<Token>>(&any))
        return holds(*strings, [](Token x) { return x == poison_token(); });
    return false;
}

}  // namespace

UndeclaredColumns::UndeclaredColumns(PointSet& points, std::span<const Uses> declared) : ids_(points.id())
{
    const std::vector<std::string> own = point_names_of(PointName::OwnColumn);
    std::set<std::string> names(own.begin(), own.end());
    for (const Uses& uses : declared) {
        if (uses.reads_all) return;
        add_names(uses, names);
    }
    for (const std::string& name : points.column_names()) {
        if (names.count(name)) continue;
        AnyColumn& column = *points.find(name);
        columns_.emplace(name, column);
        std::visit([](auto& values) { poison(values); }, column);
    }
    for (const std::string& name : points.group_names()) {
        if (names.count(group_prefix + name)) continue;
        groups_.emplace(name, points.group(name));
        poison(points.group(name));
    }
}

void UndeclaredColumns::restore(PointSet& points) const
{
    const Survivors survivors = survivors_of(ids_, points.id());
    for (const auto& [name, before] : columns_) {
        AnyColumn* after = points.find(name);
        if (!after || after->index() != before.index())
            throw Error(fmt::format("it removes \"{}\", which it does not declare", name));
        std::visit(
            [&, &name = name, &before = before](auto& column) {
                restore_values(name, std::get<std::remove_cvref_t<decltype(column)>>(before), survivors, column);
            },
            *after);
    }
    for (const auto& [name, before] : groups_) {
        if (!points.find_group(name))
            throw Error(fmt::format("it removes the group \"{}\", which it does not declare", name));
        restore_values(name, before, survivors, points.group(name));
    }
    for (const auto& [name, column] : points.columns())
        if (!columns_.count(name) && is_poisoned(column))
            throw Error(fmt::format("it reads a column that it does not declare: \"{}\" depends on it", name));
}

}  // namespace rapid

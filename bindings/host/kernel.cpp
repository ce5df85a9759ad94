#include "bindings/host/kernel.h"

#include <algorithm>

#include "bindings/host/kernel_pass.h"
#include "bindings/host/script_host.h"
#include "runtime/points/members.h"
#include "runtime/points/point_names.h"
#include "runtime/shapes/mesh/mesh.h"

namespace rapid {

void Kernel::analyse()
{
    analysis_ = analyse_kernel(host_.main(), source);
    fingerprint = fingerprint_of(host_.main(), source.number);
    if (source.of_the_set) return;
    objects_ = objects_of(host_.main(), source.number);
    for (const ObjectPtr& object : objects_.value_or(std::vector<ObjectPtr>()))
        if (is_moving_shape(*object) || dynamic_cast<const Mesh*>(object.get())) moving_.push_back(object);
}

void Kernel::begin_step(const FrameClock& clock, const Frame& frame) const
{
    step_shapes_.clear();
    for (const ObjectPtr& object : moving_) step_shapes_.emplace_back(object.get(), step_shape(object, clock, frame));
}

void Kernel::uses(Uses& uses, const KernelArguments& arguments) const
{
    this->uses(uses);
    uses.reads.insert(uses.reads.end(), arguments.reads.begin(), arguments.reads.end());
    uses.writes.insert(uses.writes.end(), arguments.writes.begin(), arguments.writes.end());
    uses.makes_groups.insert(uses.makes_groups.end(), arguments.joins.begin(), arguments.joins.end());
    uses.joins_groups.insert(uses.joins_groups.end(), arguments.joins.begin(), arguments.joins.end());
}

void Kernel::uses_in_action(Uses& uses, const KernelArguments& arguments) const
{
    this->uses(uses, arguments);
    for (auto* names : {&uses.reads, &uses.writes, &uses.may}) std::erase(*names, "force");
}

void Kernel::uses(Uses& uses) const
{
    const auto add_attributes = [](const std::set<std::string>& names, std::vector<std::string>& into) {
        for (const std::string& name : names) {
            const PointName* known = find_point_name(name);
            if (!known || known->role == PointName::OwnColumn) into.push_back(name);
        }
    };
    const auto add = [](const std::set<std::string>& names, std::vector<std::string>& into) {
        into.insert(into.end(), names.begin(), names.end());
    };
    add_attributes(analysis_.reads, uses.reads);
    add_attributes(analysis_.writes, uses.writes);
    add_attributes(analysis_.may, uses.may);
    add(analysis_.joins, uses.makes_groups);
    add(analysis_.joins, uses.joins_groups);
    add(analysis_.queries, uses.takes_groups);
    // The bytecode does not show which attributes a function of all points reads by a method's argument.
    if (source.of_the_set || analysis_.queries_any_group) uses.reads_all = true;
}

KernelLayout Kernel::layout_for(const PointSet& points, const KernelArguments& arguments, bool predicate) const
{
    KernelLayout layout;
    layout.predicate = predicate;
    for (const auto& [name, column] : points.columns()) {
        const bool assigned =
            analysis_.writes.count(name) || analysis_.may_write.count(name) || arguments.writes.count(name);
        const bool written = !predicate && assigned && !is_read_only(name);
        const bool read = analysis_.reads.count(name) || analysis_.may.count(name) || arguments.reads.count(name) ||
                          name == "id";  // p:rand needs it
        if (written || read) layout.columns.push_back({name, std::string(type_name(type_of(column))), written});
    }
    for (const auto& [name, members] : points.groups()) {
        const bool written = !predicate && (analysis_.joins.count(name) || arguments.joins.count(name));
        if (written || analysis_.queries_any_group || analysis_.queries.count(name))
            layout.groups.push_back({name, "", written});
    }
    return layout;
}

std::optional<KernelLayout> Kernel::make_writable(PointSet& points, const std::string& group,
                                                  const KernelArguments& arguments) const
{
    for (const auto* names : {&analysis_.joins, &arguments.joins})
        for (const std::string& name : *names) points.group(name);
    const Strided<std::uint8_t> members = members_of(points, group);
    if (points.empty() || (members.stride == 0 && !members[0])) return std::nullopt;
    KernelLayout layout = layout_for(points, arguments, false);
    layout.make_writable(points);
    return layout;
}

// In reversed order the chunk is the whole set, so that the last point comes first.
std::size_t Kernel::chunk_of(const KernelCaller& caller, std::size_t size) const
{
    return host_.sequence_of(caller.node) == KernelOrder::Reversed ? std::max(size, chunk_size) : chunk_size;
}

}  // namespace rapid

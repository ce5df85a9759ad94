#include "runtime/points/point_set.h"

#include <fmt/format.h>
#include <tbb/parallel_for_each.h>

#include <algorithm>
#include <functional>

#include "runtime/base/parallel.h"

namespace rapid {

Compaction Compaction::from_mask(std::span<const std::uint8_t> keep)
{
    Compaction result;
    for (std::size_t i = 0; i < keep.size();) {
        // Few points die at a time, so gaps are short and runs long.
        while (i < keep.size() && keep[i] == 0) ++i;
        if (i == keep.size()) break;
        const void* removed = std::memchr(keep.data() + i, 0, keep.size() - i);
        const std::size_t end = removed ? static_cast<const std::uint8_t*>(removed) - keep.data() : keep.size();
        if (result.runs.empty() || end - i > result.runs[result.longest].size) {
            result.longest = result.runs.size();
            result.ahead = result.kept;
        }
        result.runs.push_back({i, end - i});
        result.kept += end - i;
        i = end;
    }
    return result;
}

std::string_view type_name(AttributeType type)
{
    constexpr std::string_view names[] = {"float", "vec3", "int32", "int64", "quat", "string"};
    static_assert(std::size(names) == std::variant_size_v<AnyColumn>);
    return names[static_cast<std::size_t>(type)];
}

const std::vector<AttributeSpec>& known_attributes()
{
    static const std::vector<AttributeSpec> known = [] {
        const Vec3f zero = Vec3f::Zero();
        return std::vector<AttributeSpec>{
            {"age", 0.0f},
            {"airresist", 0.0f},
            {"birthtime", 0.0f},
            {"contactnum", std::int32_t{0}},
            {"force", zero},
            {"frictionforce", 0.0f},
            {"hitimpulse", 0.0f},
            {"hitnml", zero},
            {"hitnum", std::int32_t{0}},
            {"hitpath", std::int32_t{-1}},
            {"hitpos", zero},
            {"hittime", -1.0f},
            {"hittotal", std::int32_t{0}},
            {"hitv", zero},
            {"life", std::numeric_limits<float>::infinity()},
            {"mass", 1.0f},
            {"normalforce", 0.0f},
            {"parent", std::int64_t{-1}},
            {"pscale", 0.0f},
            {"targetv", zero},
        };
    }();
    return known;
}

const AttributeSpec* known_attribute(std::string_view name)
{
    for (const AttributeSpec& spec : known_attributes())
        if (spec.name == name) return &spec;
    return nullptr;
}

PointSet::PointSet()
{
    columns_.emplace("P", Column<Vec3f>());
    columns_.emplace("v", Column<Vec3f>());
    columns_.emplace("id", Column<std::int64_t>(0, -1));
}

std::vector<std::string> PointSet::column_names() const
{
    std::vector<std::string> names;
    for (const auto& [name, column] : columns_) names.push_back(name);
    return names;
}

std::vector<std::string> PointSet::group_names() const
{
    std::vector<std::string> names;
    for (const auto& [name, members] : groups_) names.push_back(name);
    return names;
}

const AnyColumn* PointSet::find(std::string_view name) const
{
    const auto found = columns_.find(name);
    return found == columns_.end() ? nullptr : &found->second;
}

AnyColumn* PointSet::find(std::string_view name) { return const_cast<AnyColumn*>(std::as_const(*this).find(name)); }

void PointSet::no_column(std::string_view name, const AnyColumn& expected) const
{
    if (const AnyColumn* other = find(name))
        throw Error(fmt::format("attribute \"{}\" is {}; it must be {}", name, type_name(type_of(*other)),
                                type_name(type_of(expected))));
    throw Error(fmt::format("no attribute \"{}\"{}", name, did_you_mean(name, column_names())));
}

AnyColumn& PointSet::add(const AttributeSpec& spec)
{
    if (AnyColumn* existing = find(spec.name)) {
        if (existing->index() != spec.fallback.index())
            throw Error(fmt::format("attribute \"{}\" is {} already; it can't be {} too", spec.name,
                                    type_name(type_of(*existing)), type_name(type_of(spec.fallback))));
        return *existing;
    }
    return std::visit(
        [&](const auto& value) -> AnyColumn& {
            using T = std::decay_t<decltype(value)>;
            return columns_.emplace(spec.name, Column<T>(size_, value)).first->second;
        },
        spec.fallback);
}

AnyColumn& PointSet::set_fallback(const AttributeSpec& spec)
{
    AnyColumn& column = add(spec);
    std::visit([&](auto& c) { c.set_fallback(std::get<std::decay_t<decltype(c.fallback())>>(spec.fallback)); }, column);
    return column;
}

void PointSet::set(std::string_view name, AnyColumn column)
{
    RAPID_ASSERT(std::visit([](const auto& c) { return c.size(); }, column) == size_);
    columns_.insert_or_assign(std::string(name), std::move(column));
}

void PointSet::remove(std::string_view name)
{
    RAPID_ASSERT(name != "P" && name != "v" && name != "id");
    if (const auto found = columns_.find(name); found != columns_.end()) columns_.erase(found);
}

Column<std::uint8_t>& PointSet::group(std::string_view name)
{
    const auto found = groups_.find(name);
    if (found != groups_.end()) return found->second;
    return groups_.emplace(std::string(name), Column<std::uint8_t>(size_, 0)).first->second;
}

const Column<std::uint8_t>* PointSet::find_group(std::string_view name) const
{
    const auto found = groups_.find(name);
    return found == groups_.end() ? nullptr : &found->second;
}

void PointSet::remove_group(std::string_view name)
{
    if (const auto found = groups_.find(name); found != groups_.end()) groups_.erase(found);
}

void PointSet::append(std::size_t n) { append(n, {}, {}); }

void PointSet::append(std::size_t n, const std::vector<AttributeSpec>& values, const std::vector<std::string>& groups)
{
    if (n == 0) return;
    // Fills in parallel, because the system clears pages on first write.
    std::vector<std::function<void(std::size_t begin, std::size_t end)>> fills;
    const auto append_to = [&](auto& column, const auto& value) {
        if (column.is_uniform() || column.size() == 0) return column.append(n, value);
        fills.emplace_back([added = column.append_for_writing(n), value](std::size_t begin, std::size_t end) {
            std::uninitialized_fill(added.data() + begin, added.data() + end, value);
        });
    };
    for (auto& [name, column] : columns_)
        std::visit(
            [&, &key = name](auto& c) {
                const auto given =
                    std::find_if(values.begin(), values.end(), [&](const auto& s) { return s.name == key; });
                using T = std::decay_t<decltype(c.fallback())>;
                append_to(c, given == values.end() ? c.fallback() : std::get<T>(given->fallback));
            },
            column);
    for (auto& [name, members] : groups_)
        append_to(members, std::uint8_t{std::find(groups.begin(), groups.end(), name) != groups.end()});
    size_ += n;
    for_each_chunk(n, [&](std::size_t begin, std::size_t end) {
        for (const auto& fill : fills) fill(begin, end);
    });
}

void PointSet::keep(std::span<const std::uint8_t> mask)
{
    RAPID_ASSERT(mask.size() == size_);
    const Compaction compaction = Compaction::from_mask(mask);
    if (compaction.kept == size_) return;

    std::vector<std::function<void()>> tasks;
    for (auto& [name, column] : columns_)
        tasks.emplace_back([&compaction, &any = column] { std::visit([&](auto& c) { c.keep(compaction); }, any); });
    for (auto& [name, members] : groups_) tasks.emplace_back([&compaction, &m = members] { m.keep(compaction); });
    tbb::parallel_for_each(tasks, [](const std::function<void()>& task) { task(); });
    size_ = compaction.kept;
}

PointSet PointSet::select(std::span<const std::uint32_t> indices) const
{
    PointSet set;
    set.size_ = indices.size();
    set.columns_.clear();
    for (const auto& [name, column] : columns_)
        set.columns_.emplace(name, std::visit([&](const auto& c) { return AnyColumn(c.select(indices)); }, column));
    for (const auto& [name, members] : groups_) set.groups_.emplace(name, members.select(indices));
    set.details = details;
    return set;
}

void PointSet::put(std::span<const std::uint32_t> indices, const PointSet& from)
{
    RAPID_ASSERT(indices.size() == from.size());
    const auto put_into = [&]<class T>(Column<T>& column, const Column<T>& other) {
        if (indices.empty()) return;
        if (column.is_uniform() && other.is_uniform() && column[0] == other[0]) return;
        const std::span<T> to = column.write();
        const Strided<T> values = other.read();
        for (std::size_t i = 0; i < indices.size(); ++i) to[indices[i]] = values[i];
    };
    for (auto& [name, column] : columns_)
        if (const AnyColumn* other = from.find(name))
            std::visit(
                [&]<class T>(Column<T>& c) {
                    if (const auto* same = std::get_if<Column<T>>(other)) put_into(c, *same);
                },
                column);
    for (auto& [name, members] : groups_)
        if (const Column<std::uint8_t>* other = from.find_group(name)) put_into(members, *other);
}

void PointSet::reorder(std::span<const std::uint32_t> order)
{
    RAPID_ASSERT(order.size() == size_);
    const auto reordered = [&](auto& column) {
        if (column.is_uniform()) return;
        const auto before = column;  // shares the values, so that overwrite() below leaves them alone
        const auto from = before.read();
        const auto to = column.overwrite();
        for (std::size_t i = 0; i < order.size(); ++i) to[i] = from[order[i]];
    };
    for (auto& [name, column] : columns_) std::visit(reordered, column);
    for (auto& [name, members] : groups_) reordered(members);
}

std::size_t PointSet::bytes() const
{
    std::size_t total = 0;
    for (const auto& [name, column] : columns_) total += std::visit([](const auto& c) { return c.bytes(); }, column);
    for (const auto& [name, members] : groups_) total += members.bytes();
    return total;
}

}  // namespace rapid

#include "runtime/io/merge_parts.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <functional>
#include <numeric>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>

#include "runtime/base/parallel.h"
#include "runtime/base/per_thread.h"
#include "runtime/points/column_files.h"
#include "runtime/points/id_index.h"
#include "runtime/points/subset.h"

namespace rapid {
namespace {

// Points that are merged together. Their list stays in the second-level cache.
constexpr std::size_t bucket_points = 32768;

void check_ids(const PointSet& points, std::size_t part, std::size_t count, const std::string& name)
{
    const Strided<std::int64_t> ids = points.id().read();
    for_each_chunk(points.size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            if (i > 0 && ids[i] <= ids[i - 1])
                throw Error(fmt::format("point {} comes after point {}; the points of a part must be in order of id",
                                        ids[i], ids[i - 1]))
                    .at({name, 0});
            if (const std::uint64_t own = Subset::part_of(ids[i], count); own != part)
                throw Error(
                    fmt::format("point {} is not of part {} of {}, but of part {}", ids[i], part + 1, count, own + 1))
                    .at({name, 0});
        }
        trim_columns();
    });
}

// Returns the type of a column in all parts that have points. Throws Error if the types are incompatible.
AttributeType common_type(const std::string& name, const std::vector<PointSet>& parts,
                          const std::vector<std::string>& names)
{
    std::optional<AttributeType> type;
    std::size_t of = 0;
    for (std::size_t k = 0; k < parts.size(); ++k) {
        if (parts[k].empty()) continue;
        const AttributeType here = type_of(*parts[k].find(name));
        if (!type || here == *type) {
            if (!type) type = here, of = k;
            continue;
        }
        const auto is_whole = [](AttributeType t) { return t == AttributeType::Int32 || t == AttributeType::Int64; };
        const auto either = [&](AttributeType t) { return here == t || *type == t; };
        if (is_whole(here) && is_whole(*type))
            type = AttributeType::Int64;
        else if (either(AttributeType::Float) && (is_whole(here) || is_whole(*type)))
            type = AttributeType::Float;
        else
            throw Error(
                fmt::format("the attribute {} is {}, but {} in {}", name, type_name(here), type_name(*type), names[of]))
                .at({names[k], 0});
    }
    return type.value_or(type_of(*parts.front().find(name)));
}

void check_columns(const std::vector<PointSet>& parts, const std::vector<std::string>& names)
{
    for (std::size_t k = 1; k < parts.size(); ++k)
        if (parts[k].column_names() != parts[0].column_names() || parts[k].group_names() != parts[0].group_names())
            throw Error(fmt::format("it has the attributes and groups {} {}, but {} has {} {}",
                                    fmt::join(parts[k].column_names(), " "), fmt::join(parts[k].group_names(), " "),
                                    names[0], fmt::join(parts[0].column_names(), " "),
                                    fmt::join(parts[0].group_names(), " ")))
                .at({names[k], 0});
}

// The points in a range of ids: [begin[k], end[k]) of part k, starting at `first` in the result.
struct Bucket {
    std::vector<std::size_t> begin, end;
    std::size_t first = 0, size = 0;
};

std::vector<Bucket> buckets_of(const std::vector<PointSet>& parts)
{
    const auto largest = std::max_element(parts.begin(), parts.end(),
                                          [](const PointSet& a, const PointSet& b) { return a.size() < b.size(); });
    const std::size_t of_largest = std::max<std::size_t>(1, bucket_points / parts.size());
    std::vector<Bucket> buckets;
    std::vector<std::size_t> at(parts.size(), 0);
    std::size_t first = 0;
    for (std::size_t index = 0; index < std::max<std::size_t>(1, largest->size()); index += of_largest) {
        const std::size_t next = index + of_largest;
        Bucket bucket{at, {}, first, 0};
        for (std::size_t k = 0; k < parts.size(); ++k) {
            const Strided<std::int64_t> ids = parts[k].id().read();
            if (next >= largest->size())
                at[k] = parts[k].size();
            else
                at[k] = first_not_below(ids, at[k], parts[k].size(), largest->id()[next]);
            bucket.size += at[k] - bucket.begin[k];
        }
        bucket.end = at;
        first += bucket.size;
        buckets.push_back(std::move(bucket));
        trim_columns();
    }
    return buckets;
}

// Reads a bucket's values of a column, part by part.
template <class T>
void read_bucket(const std::vector<Strided<T>>& parts, const Bucket& bucket, std::vector<T>& values)
{
    values.resize(bucket.size, Column<T>::zero());
    T* to = values.data();
    for (std::size_t k = 0; k < parts.size(); ++k) {
        const std::size_t size = bucket.end[k] - bucket.begin[k];
        read_values(to, parts[k], bucket.begin[k], size);
        to += size;
    }
}

// Finds, for each point of the result in order of id, its index among the points of the parts.
void find_sources(const std::vector<std::int64_t>& ids, std::vector<std::uint32_t>& sources)
{
    sources.clear();
    if (ids.empty()) return;
    const auto [least, most] = std::minmax_element(ids.begin(), ids.end());
    const std::uint64_t range = static_cast<std::uint64_t>(*most) - static_cast<std::uint64_t>(*least);
    if (range >= 8 * ids.size()) {
        sources.resize(ids.size());
        std::iota(sources.begin(), sources.end(), 0u);
        std::sort(sources.begin(), sources.end(), [&](std::uint32_t a, std::uint32_t b) { return ids[a] < ids[b]; });
        return;
    }
    // Usually ids are dense, so each has its own slot.
    constexpr std::uint32_t none = UINT32_MAX;
    thread_local PerThread<std::vector<std::uint32_t>> kept;
    std::vector<std::uint32_t>& by_id = *kept;
    by_id.assign(range + 1, none);
    for (std::uint32_t i = 0; i < ids.size(); ++i) by_id[static_cast<std::size_t>(ids[i] - *least)] = i;
    for (const std::uint32_t i : by_id)
        if (i != none) sources.push_back(i);
}

// Gathers a bucket's values of one column.
using Gather = std::function<void(const Bucket& bucket, const std::vector<std::uint32_t>& sources)>;

template <class T, class From>
T converted(const From& value)
{
    if constexpr (std::is_convertible_v<From, T>)
        return static_cast<T>(value);
    else
        return Column<T>::zero();  // the part has no points
}

template <class T, class Get>
Gather gather_into(std::span<T> values, const std::vector<PointSet>& parts, const Get& columns_of)
{
    // Handles both a column of the same type in all parts, which is the usual case, and one that must be converted.
    std::vector<Strided<T>> from;
    for (const PointSet& part : parts)
        if (const Column<T>* column = columns_of(part)) from.push_back(column->read());
    RAPID_ASSERT(from.size() == parts.size());
    return [values, from](const Bucket& bucket, const std::vector<std::uint32_t>& sources) {
        thread_local PerThread<std::vector<T>> kept_read, kept_gathered;
        std::vector<T>&read = *kept_read, &gathered = *kept_gathered;
        read_bucket(from, bucket, read);
        gathered.clear();
        for (const std::uint32_t source : sources) gathered.push_back(read[source]);
        write_values(values.data() + bucket.first, gathered.data(), gathered.size() * sizeof(T));
    };
}

template <class T>
AnyColumn column_of(const AnyColumn& column)
{
    return std::visit(
        []<class From>(const Column<From>& c) -> AnyColumn {
            Column<T> result(0, converted<T>(c.fallback()));
            if (c.size() == 0) return result;
            const std::span<T> values = result.append_for_writing(c.size());
            for (std::size_t i = 0; i < values.size(); ++i) values[i] = converted<T>(c[i]);
            return result;
        },
        column);
}

// Returns the parts with one type per column.
std::vector<PointSet> with_common_types(const std::vector<PointSet>& parts, const std::vector<std::string>& names)
{
    std::vector<PointSet> result = parts;
    for (const std::string& name : parts.front().column_names()) {
        const AttributeType type = common_type(name, parts, names);
        for (PointSet& part : result) {
            const AnyColumn& column = *part.find(name);
            if (type_of(column) == type) continue;
            std::visit([&]<class T>(const Column<T>&) { part.set(name, column_of<T>(column)); },
                       column_of_type<AnyColumn>(static_cast<std::size_t>(type)));
        }
    }
    return result;
}

}  // namespace

PointSet merge_parts(const std::vector<PointSet>& given, const std::vector<std::string>& names)
{
    RAPID_ASSERT(!given.empty() && given.size() == names.size());
    for (std::size_t k = 0; k < given.size(); ++k) check_ids(given[k], k, given.size(), names[k]);
    check_columns(given, names);
    const std::vector<PointSet> parts = with_common_types(given, names);
    const std::vector<Bucket> buckets = buckets_of(parts);
    const std::size_t size = buckets.back().first + buckets.back().size;

    PointSet result;
    result.append(size);
    std::vector<Gather> gathers;
    for (const auto& [name, column] : parts.front().columns())
        std::visit(
            [&, &key = name]<class T>(const Column<T>& c) {
                Column<T> merged(0, c.fallback());
                if (size > 0)
                    gathers.push_back(gather_into(merged.append_for_writing(size), parts,
                                                  [&](const PointSet& part) { return part.find<T>(key); }));
                result.set(key, std::move(merged));
            },
            column);
    for (const auto& [name, members] : parts.front().groups()) {
        Column<std::uint8_t> merged(0, 0);
        if (size > 0)
            gathers.push_back(gather_into(merged.append_for_writing(size), parts,
                                          [&, &key = name](const PointSet& part) { return part.find_group(key); }));
        result.group(name) = std::move(merged);
    }
    std::vector<Strided<std::int64_t>> ids_of_parts;
    for (const PointSet& part : parts) ids_of_parts.push_back(part.id().read());
    tbb::parallel_for(std::size_t{0}, buckets.size(), [&](std::size_t b) {
        thread_local PerThread<std::vector<std::int64_t>> kept_ids;
        thread_local PerThread<std::vector<std::uint32_t>> kept_sources;
        std::vector<std::int64_t>& ids = *kept_ids;
        std::vector<std::uint32_t>& sources = *kept_sources;
        read_bucket(ids_of_parts, buckets[b], ids);
        find_sources(ids, sources);
        for (const Gather& gather : gathers) gather(buckets[b], sources);
        trim_columns();
    });
    return result;
}

}  // namespace rapid

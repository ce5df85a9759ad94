// A set of points: columns of equal size by name, and groups.
//
// P, v and id always exist. Copying a set copies pointers (columns are copy-on-write). Ids are never reused and
// identify a point through appending and removal, both of which keep the order of the points.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "runtime/points/attribute_type.h"

namespace rapid {

// A column's name, type and default, which is the value of points that do not set their own.
struct AttributeSpec {
    std::string name;
    AttributeValue fallback;
};

// Returns an attribute whose name, type and default Rapid knows (age, life, mass, pscale, ...), null for any other
// name. Reading a known attribute creates it.
const AttributeSpec* known_attribute(std::string_view name);
const std::vector<AttributeSpec>& known_attributes();

// A value of the whole set.
using DetailValue = std::variant<double, Vec3d>;

class PointSet {
public:
    PointSet();

    std::size_t size() const { return size_; }
    bool empty() const { return size_ == 0; }

    const Column<Vec3f>& P() const { return column<Vec3f>("P"); }
    const Column<Vec3f>& v() const { return column<Vec3f>("v"); }
    const Column<std::int64_t>& id() const { return column<std::int64_t>("id"); }
    Column<Vec3f>& P() { return column<Vec3f>("P"); }
    Column<Vec3f>& v() { return column<Vec3f>("v"); }
    Column<std::int64_t>& id() { return column<std::int64_t>("id"); }

    // Columns and groups, sorted by name.
    using Columns = std::map<std::string, AnyColumn, std::less<>>;
    using Groups = std::map<std::string, Column<std::uint8_t>, std::less<>>;
    const Columns& columns() const { return columns_; }
    const Groups& groups() const { return groups_; }
    std::vector<std::string> column_names() const;
    std::vector<std::string> group_names() const;

    bool has(std::string_view name) const { return columns_.find(name) != columns_.end(); }
    const AnyColumn* find(std::string_view name) const;
    AnyColumn* find(std::string_view name);

    // Returns null if there is no such column, or if it has another type.
    template <class T>
    const Column<T>* find(std::string_view name) const
    {
        const AnyColumn* any = find(name);
        return any ? std::get_if<Column<T>>(any) : nullptr;
    }
    template <class T>
    Column<T>* find(std::string_view name)
    {
        AnyColumn* any = find(name);
        return any ? std::get_if<Column<T>>(any) : nullptr;
    }

    // Returns an existing column. Throws Error if the attribute does not exist (suggesting the nearest name) or has
    // another type.
    template <class T>
    const Column<T>& column(std::string_view name) const
    {
        if (const Column<T>* found = find<T>(name)) return *found;
        no_column(name, AnyColumn(Column<T>()));
    }
    template <class T>
    Column<T>& column(std::string_view name)
    {
        return const_cast<Column<T>&>(std::as_const(*this).column<T>(name));
    }

    // Creates the column with its fallback value for every point. An existing column is left as it is; its type must
    // match.
    AnyColumn& add(const AttributeSpec& spec);
    // Like add(), and also sets the fallback value of an existing column.
    AnyColumn& set_fallback(const AttributeSpec& spec);
    // Replaces or adds a column; its size must be the set's.
    void set(std::string_view name, AnyColumn column);
    void remove(std::string_view name);

    // Returns the group's membership, 0 or 1 per point. Creates an empty group if it does not exist.
    Column<std::uint8_t>& group(std::string_view name);
    const Column<std::uint8_t>* find_group(std::string_view name) const;
    void remove_group(std::string_view name);

    // Adds n points: every column gets its fallback value (P and v zero), groups 0, and ids -1 until the caller sets
    // them.
    void append(std::size_t n);
    // Adds n points with these values in the named columns, as members of the named groups, all of which must exist.
    // A column that is uniform with the same value stays uniform.
    void append(std::size_t n, const std::vector<AttributeSpec>& values, const std::vector<std::string>& groups);

    // Removes the points whose mask is 0, shape [size]; the others keep their order. Columns are compacted in parallel.
    void keep(std::span<const std::uint8_t> mask);

    // Returns the points at these indices, in this order, as a new set.
    PointSet select(std::span<const std::uint32_t> indices) const;
    // Overwrites the points at these indices with those of `from`, a set with the same columns and groups; shape
    // [from.size()].
    void put(std::span<const std::uint32_t> indices, const PointSet& from);

    // Moves point order[i] to index i. `order` is a permutation, shape [size].
    void reorder(std::span<const std::uint32_t> order);

    // Returns the bytes of all columns and groups.
    std::size_t bytes() const;

    std::map<std::string, DetailValue, std::less<>> details;

private:
    [[noreturn]] void no_column(std::string_view name, const AnyColumn& expected) const;

    std::size_t size_ = 0;
    Columns columns_;
    Groups groups_;
};

}  // namespace rapid

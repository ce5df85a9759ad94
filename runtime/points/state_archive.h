// Cereal archives that write and read a SavedState. A type with state has one member function, which both archives
// call:
//
//   template <class Archive>
//   void serialize(Archive& keep)
//   {
//       keep(clock_, ids_, impulses_);
//   }
//
// Numbers are stored in the machine's format. Columns are shared, not copied.
#pragma once

#include <algorithm>
#include <array>
#include <cereal/cereal.hpp>
#include <cereal/types/array.hpp>
#include <cereal/types/map.hpp>
#include <cereal/types/optional.hpp>
#include <cereal/types/set.hpp>
#include <cereal/types/string.hpp>
#include <cereal/types/utility.hpp>
#include <cereal/types/variant.hpp>
#include <cereal/types/vector.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "runtime/points/point_set.h"
#include "runtime/points/saved_state.h"

namespace rapid {

class StateWriter : public cereal::OutputArchive<StateWriter, cereal::AllowEmptyClassElision> {
public:
    StateWriter() : OutputArchive(this) {}

    SavedState take() { return std::move(state_); }

    void write(const void* data, std::size_t bytes)
    {
        const char* first = static_cast<const char*>(data);
        state_.bytes.insert(state_.bytes.end(), first, first + bytes);
    }
    // Returns the column's index in the state. Columns that share their values share the index.
    template <class T>
    std::uint32_t slot_of(const Column<T>& column)
    {
        for (std::size_t k = 0; k < state_.columns.size(); ++k) {
            const auto* known = std::get_if<Column<T>>(&state_.columns[k]);
            if (known && known->shares_values_with(column) && known->size() == column.size())
                return static_cast<std::uint32_t>(k);
        }
        state_.columns.push_back(column);
        return static_cast<std::uint32_t>(state_.columns.size() - 1);
    }

private:
    SavedState state_;
};

class StateReader : public cereal::InputArchive<StateReader, cereal::AllowEmptyClassElision> {
public:
    // The state must outlive the reader.
    explicit StateReader(const SavedState& state) : InputArchive(this), state_(state) {}

    // Throws Error if fewer bytes are left.
    void read(void* data, std::size_t bytes);
    // Throws Error if the remaining bytes cannot hold that many elements of at least a byte each.
    void require(std::uint64_t elements) const;
    // Throws Error if unread bytes remain.
    void finish() const;
    // Throws Error unless the value read is possible in a state that a run has written. Foreign files may contain
    // anything.
    static void expect(bool is_possible)
    {
        if (!is_possible) fail();
    }

    template <class T>
    const Column<T>& column_at(std::uint32_t slot) const
    {
        const auto* column = slot < state_.columns.size() ? std::get_if<Column<T>>(&state_.columns[slot]) : nullptr;
        if (!column) fail();
        return *column;
    }
    [[noreturn]] static void fail();

private:
    const SavedState& state_;
    std::size_t done_ = 0;  // bytes
};

template <class Archive>
concept StateArchive = std::is_same_v<Archive, StateWriter> || std::is_same_v<Archive, StateReader>;

template <class T>
constexpr bool is_number_or_vector = std::is_arithmetic_v<T> && !std::is_same_v<T, bool>;
template <class S, int rows, int columns, int options>
constexpr bool is_number_or_vector<Eigen::Matrix<S, rows, columns, options, rows, columns>> = true;
template <>
inline constexpr bool is_number_or_vector<Quatf> = true;

// Types without pointers or padding: a list of them is written as one block.
template <class T>
constexpr bool is_plain = is_number_or_vector<T>;
template <class T, std::size_t n>
constexpr bool is_plain<std::array<T, n>> = is_plain<T>;

template <class T>
requires is_number_or_vector<T>
void save(StateWriter& to, const T& value) { to.write(&value, sizeof value); }
template <class T>
requires is_number_or_vector<T>
void load(StateReader& from, T& value) { from.read(static_cast<void*>(&value), sizeof value); }

// Tokens are stored as strings, because their numbers differ between processes.
void save(StateWriter& to, const Token& token);
void load(StateReader& from, Token& token);

// Bools are stored as a byte and checked: reading a byte other than 0 or 1 as a bool is undefined.
inline void save(StateWriter& to, const bool& value) { save(to, static_cast<std::uint8_t>(value)); }
inline void load(StateReader& from, bool& value)
{
    std::uint8_t byte = 0;
    load(from, byte);
    value = byte != 0;
}

// Reads cereal's own format. Cereal's function throws an exception other than Error if the index is out of range.
template <class First, class... Rest>
void load(StateReader& from, std::variant<First, Rest...>& value)
{
    std::int32_t index = 0;
    from(index);
    StateReader::expect(0 <= index && index <= static_cast<std::int32_t>(sizeof...(Rest)));
    const auto load_if = [&]<std::size_t k>(std::integral_constant<std::size_t, k>) {
        if (static_cast<std::size_t>(index) == k) from(value.template emplace<k>());
    };
    [&]<std::size_t... k>(std::index_sequence<k...>) { (load_if(std::integral_constant<std::size_t, k>()), ...); }
    (std::make_index_sequence<sizeof...(Rest) + 1>());
}

template <class T>
requires(is_plain<T> && !std::is_arithmetic_v<T>) void save(StateWriter& to, const std::vector<T>& values)
{
    to(cereal::make_size_tag(static_cast<cereal::size_type>(values.size())));
    to.write(values.data(), values.size() * sizeof(T));
}
template <class T>
requires(is_plain<T> && !std::is_arithmetic_v<T>) void load(StateReader& from, std::vector<T>& values)
{
    cereal::size_type size = 0;
    from(cereal::make_size_tag(size));
    values.resize(static_cast<std::size_t>(size));
    from.read(static_cast<void*>(values.data()), values.size() * sizeof(T));
}

template <class T>
void save(StateWriter& to, const Column<T>& column)
{
    const bool is_uniform = column.is_uniform();
    to(column.size(), column.fallback(), is_uniform);
    if (is_uniform)
        to(*column.read().data);
    else
        to(to.slot_of(column));
}
template <class T>
void load(StateReader& from, Column<T>& column)
{
    std::size_t size = 0;
    T fallback = Column<T>::zero();
    bool is_uniform = false;
    from(size, fallback, is_uniform);
    if (is_uniform) {
        T value = Column<T>::zero();
        from(value);
        column = Column<T>(size, value, fallback);
        return;
    }
    std::uint32_t slot = 0;
    from(slot);
    column = from.column_at<T>(slot);
    column.set_fallback(fallback);
    if (column.size() != size) StateReader::fail();
}

void save(StateWriter& to, const PointSet& points);
void load(StateReader& from, PointSet& points);

// Save and load nested states.
void save(StateWriter& to, const SavedState& state);
void load(StateReader& from, SavedState& state);

// Serialises cereal's wrappers of values.
template <StateArchive Archive, class T>
void serialize(Archive& keep, cereal::NameValuePair<T>& pair)
{
    keep(pair.value);
}
template <class T>
void save(StateWriter& to, const cereal::SizeTag<T>& tag)
{
    to(static_cast<cereal::size_type>(tag.size));
}
template <class T>
void load(StateReader& from, cereal::SizeTag<T>& tag)
{
    from(tag.size);
    from.require(tag.size);
}
template <class T>
void save(StateWriter& to, const cereal::BinaryData<T>& data)
{
    to.write(data.data, static_cast<std::size_t>(data.size));
}
template <class T>
void load(StateReader& from, cereal::BinaryData<T>& data)
{
    from.read(data.data, static_cast<std::size_t>(data.size));
}

// Returns the state of an object that has serialize().
template <class T>
SavedState state_of(const T& kept)
{
    StateWriter writer;
    writer(kept);
    return writer.take();
}
// Throws Error if the state belongs to another type.
template <class T>
void restore(T& kept, const SavedState& state)
{
    StateReader reader(state);
    reader(kept);
    reader.finish();
}

// Checks on lists from a snapshot before they are used as indices (StateReader::expect).
inline bool are_below(std::span<const std::uint32_t> list, std::size_t limit)
{
    return std::all_of(list.begin(), list.end(), [&](std::uint32_t i) { return i < limit; });
}
inline bool are_below(const std::vector<std::array<std::uint32_t, 2>>& list, std::size_t limit)
{
    return std::all_of(list.begin(), list.end(), [&](const auto& pair) { return are_below(pair, limit); });
}

// Returns true if `begin` has the offset of each of `lists` lists within `total` elements, followed by the end.
inline bool are_offsets(const std::vector<std::uint32_t>& begin, std::size_t lists, std::size_t total)
{
    return begin.size() == lists + 1 && begin.front() == 0 && begin.back() == total &&
           std::is_sorted(begin.begin(), begin.end());
}

// Returns true if the ids strictly ascend.
inline bool ascend(std::span<const std::int64_t> ids)
{
    return std::adjacent_find(ids.begin(), ids.end(), std::greater_equal<>()) == ids.end();
}

inline bool is_between(double x, double least, double most) { return least <= x && x <= most; }  // false for NaN

}  // namespace rapid

CEREAL_SETUP_ARCHIVE_TRAITS(rapid::StateReader, rapid::StateWriter)

#include "runtime/points/saved_state.h"

#include <algorithm>
#include <cstring>

#include "runtime/base/error.h"
#include "runtime/points/state_archive.h"

namespace rapid {
namespace {

constexpr std::size_t most_alike = std::size_t{1} << 20;  // points in a set whose columns are all uniform

bool are_memberships(const Column<std::uint8_t>& members)
{
    const Strided<std::uint8_t> values = members.read();
    return std::all_of(values.data, values.data + (values.stride ? members.size() : 1),
                       [](std::uint8_t member) { return member <= 1; });
}

}  // namespace

std::size_t SavedState::size() const
{
    std::size_t sum = bytes.size();
    for (const SavedColumn& any : columns) sum += std::visit([](const auto& column) { return column.bytes(); }, any);
    return sum;
}

bool SavedState::operator==(const SavedState& other) const
{
    if (bytes != other.bytes || columns.size() != other.columns.size()) return false;
    for (std::size_t k = 0; k < columns.size(); ++k) {
        const bool same = std::visit(
            []<class A, class B>(const A& a, const B& b) {
                if constexpr (std::is_same_v<A, B>)
                    return a.size() == b.size() && std::memcmp(a.read().data, b.read().data, a.bytes()) == 0;
                else
                    return false;
            },
            columns[k], other.columns[k]);
        if (!same) return false;
    }
    return true;
}

void StateReader::fail() { throw Error("the snapshot belongs to another graph or is damaged"); }

void StateReader::read(void* data, std::size_t bytes)
{
    if (bytes > state_.bytes.size() - done_) fail();
    if (bytes == 0) return;
    std::memcpy(data, state_.bytes.data() + done_, bytes);
    done_ += bytes;
}

void StateReader::require(std::uint64_t elements) const
{
    if (elements > state_.bytes.size() - done_) fail();
}

void StateReader::finish() const
{
    if (done_ != state_.bytes.size()) fail();
}

void save(StateWriter& to, const Token& token) { to(std::string(token.text())); }
void load(StateReader& from, Token& token)
{
    std::string text;
    from(text);
    token = token_of(text);
}

void save(StateWriter& to, const PointSet& points)
{
    to(points.size(), points.columns(), points.groups(), points.details);
}

void load(StateReader& from, PointSet& points)
{
    std::size_t size = 0;
    PointSet::Columns columns;
    PointSet::Groups groups;
    PointSet loaded;
    from(size, columns, groups, loaded.details);
    const auto has_values = [&](const auto& entry) {
        return std::visit([](const auto& column) { return !column.is_uniform(); }, entry.second);
    };
    // If no column has a value per point, nothing confirms the set's size.
    StateReader::expect(size <= most_alike || std::any_of(columns.begin(), columns.end(), has_values));
    for (const auto& [name, any] : columns)
        StateReader::expect(std::visit([](const auto& column) { return column.size(); }, any) == size);
    for (const auto& [name, members] : groups) StateReader::expect(members.size() == size && are_memberships(members));
    // All sizes are checked by now. Appending takes time in proportion to the number of points.
    loaded.append(size);
    for (auto& [name, any] : columns) loaded.set(name, std::move(any));
    for (auto& [name, members] : groups) loaded.group(name) = std::move(members);
    points = std::move(loaded);
}

void save(StateWriter& to, const SavedState& state)
{
    to(state.bytes, state.columns.size());
    for (const SavedColumn& any : state.columns)
        std::visit(
            [&]<class T>(const Column<T>& column) { to(static_cast<std::uint8_t>(any.index()), to.slot_of(column)); },
            any);
}

void load(StateReader& from, SavedState& state)
{
    std::size_t count = 0;
    from(state.bytes, count);
    from.require(count);
    state.columns.assign(count, Column<float>());
    for (SavedColumn& any : state.columns) {
        std::uint8_t type = 0;
        std::uint32_t slot = 0;
        from(type, slot);
        const auto take = [&]<class T>(const Column<T>&) { any = from.column_at<T>(slot); };
        if (type >= std::variant_size_v<SavedColumn>) StateReader::fail();
        std::visit(take, column_of_type<SavedColumn>(type));
    }
}

}  // namespace rapid

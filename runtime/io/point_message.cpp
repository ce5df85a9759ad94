#include "runtime/io/point_message.h"

#include <algorithm>

#include "runtime/error.h"
#include "runtime/io/text_table.h"

namespace rapid {
namespace {

template <class T>
void send_column(const Column<T>& column, MessageWriter& message)
{
    const std::size_t distinct = column.is_uniform() ? std::min<std::size_t>(column.size(), 1) : column.size();
    message.put<std::uint8_t>(column.is_uniform());
    message.put_array(std::span<const T>(column.read().data, distinct));
}

template <class T>
Column<T> receive_column(std::size_t points, MessageReader& message)
{
    Column<T> column;
    const bool uniform = message.take<std::uint8_t>() != 0;
    if (points == 0) return column;
    if (uniform) return Column<T>(points, message.take<T>(), Column<T>::zero());
    message.check_left(points, sizeof(T));
    message.take_array(column.append_for_writing(points));
    return column;
}

// Sends the strings, because the other process has its own tokens.
void send_column(const Column<Token>& column, MessageWriter& message)
{
    const TextTable table = text_table(column);
    message.put(table.texts.size());
    for (const Token text : table.texts) message.put_text(std::string(text.text()));
    send_column(table.places, message);
}

template <>
Column<Token> receive_column(std::size_t points, MessageReader& message)
{
    std::vector<Token> texts;
    for (auto left = message.take<std::size_t>(); left > 0; --left) texts.push_back(token_of(message.take_text()));
    return texts_at(texts, receive_column<std::int32_t>(points, message));
}

AnyColumn receive_any(std::uint8_t type, std::size_t points, MessageReader& message)
{
    if (type >= std::variant_size_v<AnyColumn>) throw Error("can't be read: its reader went wrong; it must be damaged");
    return std::visit([&]<class T>(const Column<T>&) -> AnyColumn { return receive_column<T>(points, message); },
                      column_of_type<AnyColumn>(type));
}

}  // namespace

void send_points(const PointSet& points, MessageWriter& message)
{
    for (const std::size_t count : {points.size(), points.columns().size(), points.groups().size()}) message.put(count);
    for (const auto& [name, column] : points.columns()) {
        message.put_text(name);
        message.put(static_cast<std::uint8_t>(type_of(column)));
        std::visit([&](const auto& c) { send_column(c, message); }, column);
    }
    for (const auto& [name, members] : points.groups()) {
        message.put_text(name);
        send_column(members, message);
    }
}

PointSet receive_points(MessageReader& message)
{
    const auto size = message.take<std::size_t>(), columns = message.take<std::size_t>(),
               groups = message.take<std::size_t>();
    message.check_left(size, sizeof(Vec3f));  // readers set P point by point, so it is not uniform
    PointSet points;
    points.append(size);
    for (std::size_t i = 0; i < columns; ++i) {
        const std::string name = message.take_text();
        const auto type = message.take<std::uint8_t>();
        points.set(name, receive_any(type, size, message));
    }
    for (std::size_t i = 0; i < groups; ++i) {
        const std::string name = message.take_text();
        Column<std::uint8_t> members = receive_column<std::uint8_t>(size, message);
        const std::span<std::uint8_t> bytes = members.is_uniform() ? std::span<std::uint8_t>() : members.write();
        for (std::uint8_t& member : bytes) member = member != 0;
        points.group(name) = std::move(members);
    }
    return points;
}

}  // namespace rapid

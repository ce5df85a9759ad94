#include "runtime/io/text_table.h"

#include <fmt/format.h>

#include <algorithm>

#include "runtime/base/parallel.h"

namespace rapid {

TextTable text_table(const Column<Token>& column)
{
    TextTable table;
    if (column.size() == 0) return table;
    if (column.is_uniform()) {
        table.strings = {column[0]};
        table.indices = Column<std::int32_t>(column.size(), 0);
        return table;
    }
    const Strided<Token> tokens = column.read();
    const auto by_number = [](const Token& a, const Token& b) { return a.number < b.number; };
    const Token last = *std::max_element(tokens.data, tokens.data + column.size(), by_number);
    constexpr std::int32_t none = -1;
    std::vector<std::int32_t> index_of(std::size_t{last.number} + 1, none);
    const std::span<std::int32_t> indices = table.indices.append_for_writing(column.size());
    for (std::size_t i = 0; i < indices.size(); ++i) {
        std::int32_t& index = index_of[tokens[i].number];
        if (index == none) {
            index = static_cast<std::int32_t>(table.strings.size());
            table.strings.push_back(tokens[i]);
        }
        indices[i] = index;
    }
    return table;
}

Token StringTokens::operator()(std::string_view text)
{
    constexpr std::size_t most = 65536;
    if (const auto found = known_.find(text); found != known_.end()) return found->second;
    const Token token = token_of(text);
    if (known_.size() >= most) known_.clear();
    known_.emplace(token.text(), token);
    return token;
}

Column<Token> strings_at(const std::vector<Token>& strings, const Column<std::int32_t>& indices)
{
    const auto text = [&](std::int32_t index) {
        if (index == -1) return Token();
        if (index < 0 || static_cast<std::size_t>(index) >= strings.size())
            throw Error(fmt::format("a point has string number {}, but there are only {}", index, strings.size()));
        return strings[static_cast<std::size_t>(index)];
    };
    if (indices.size() == 0) return Column<Token>();
    if (indices.is_uniform()) return Column<Token>(indices.size(), text(indices[0]), Token());
    Column<Token> column;
    const std::span<Token> to = column.append_for_writing(indices.size());
    const Strided<std::int32_t> from = indices.read();
    for_each_chunk(to.size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) to[i] = text(from[i]);
    });
    return column;
}

std::vector<std::string> string_column_names(const PointSet& points)
{
    std::vector<std::string> names;
    for (const auto& [name, column] : points.columns())
        if (type_of(column) == AttributeType::String) names.push_back(name);
    return names;
}

PointSet without_strings(const PointSet& points)
{
    PointSet rest = points;
    for (const std::string& name : string_column_names(points)) rest.remove(name);
    return rest;
}

}  // namespace rapid

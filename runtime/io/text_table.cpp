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
        table.texts = {column[0]};
        table.places = Column<std::int32_t>(column.size(), 0);
        return table;
    }
    const Strided<Token> tokens = column.read();
    const auto by_number = [](const Token& a, const Token& b) { return a.number < b.number; };
    const Token last = *std::max_element(tokens.data, tokens.data + column.size(), by_number);
    constexpr std::int32_t none = -1;
    std::vector<std::int32_t> place_of(std::size_t{last.number} + 1, none);
    const std::span<std::int32_t> places = table.places.append_for_writing(column.size());
    for (std::size_t i = 0; i < places.size(); ++i) {
        std::int32_t& place = place_of[tokens[i].number];
        if (place == none) {
            place = static_cast<std::int32_t>(table.texts.size());
            table.texts.push_back(tokens[i]);
        }
        places[i] = place;
    }
    return table;
}

Token TokensOfTexts::operator()(std::string_view text)
{
    constexpr std::size_t most = 65536;
    if (const auto found = known_.find(text); found != known_.end()) return found->second;
    const Token token = token_of(text);
    if (known_.size() >= most) known_.clear();
    known_.emplace(token.text(), token);
    return token;
}

Column<Token> texts_at(const std::vector<Token>& texts, const Column<std::int32_t>& places)
{
    const auto text = [&](std::int32_t place) {
        if (place == -1) return Token();
        if (place < 0 || static_cast<std::size_t>(place) >= texts.size())
            throw Error(fmt::format("a point has the text {}; there are {}", place, texts.size()));
        return texts[static_cast<std::size_t>(place)];
    };
    if (places.size() == 0) return Column<Token>();
    if (places.is_uniform()) return Column<Token>(places.size(), text(places[0]), Token());
    Column<Token> column;
    const std::span<Token> to = column.append_for_writing(places.size());
    const Strided<std::int32_t> from = places.read();
    for_each_chunk(to.size(), [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) to[i] = text(from[i]);
    });
    return column;
}

std::vector<std::string> names_of_texts(const PointSet& points)
{
    std::vector<std::string> names;
    for (const auto& [name, column] : points.columns())
        if (type_of(column) == AttributeType::String) names.push_back(name);
    return names;
}

PointSet without_texts(const PointSet& points)
{
    PointSet rest = points;
    for (const std::string& name : names_of_texts(points)) rest.remove(name);
    return rest;
}

}  // namespace rapid

// A column of texts as files hold one: each text once, in the order in which points first have it, and for each point
// the place of its own. So a file's bytes do not depend on the numbers of tokens.
#pragma once

#include <cstdint>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

struct TextTable {
    std::vector<Token> texts;
    Column<std::int32_t> places;  // of each point, among the texts
};
TextTable text_table(const Column<Token>& column);

// token_of() for the texts of a file: the table of the process, which is locked, is asked once for each of the last
// 65,536.
class TokensOfTexts {
public:
    Token operator()(std::string_view text);

private:
    std::unordered_map<std::string_view, Token> known_;
};

// The column of a table that was read. -1: the empty text. Error: a place beyond the texts.
Column<Token> texts_at(const std::vector<Token>& texts, const Column<std::int32_t>& places);

// The points without their columns of texts, for formats that hold none.
PointSet without_texts(const PointSet& points);
// The names of these columns.
std::vector<std::string> names_of_texts(const PointSet& points);

}  // namespace rapid

// A column of strings as files store it: each distinct string once, in order of first use, and for each point the index
// of its string. The file's bytes therefore do not depend on token numbers.
#pragma once

#include <cstdint>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "runtime/points/point_set.h"

namespace rapid {

struct TextTable {
    std::vector<Token> strings;
    Column<std::int32_t> indices;  // index of each point's string
};
TextTable text_table(const Column<Token>& column);

// Calls token_of() for the strings of a file. The last 65,536 are cached, because the process-wide table is locked for
// each access.
class StringTokens {
public:
    Token operator()(std::string_view text);

private:
    std::unordered_map<std::string_view, Token> known_;
};

// Builds a column from a table that was read. Index -1 means the empty string. Throws Error if an index is out of
// range.
Column<Token> strings_at(const std::vector<Token>& strings, const Column<std::int32_t>& indices);

// Returns the points without string columns, for formats that do not support them.
PointSet without_strings(const PointSet& points);
// Returns the names of the string columns.
std::vector<std::string> string_column_names(const PointSet& points);

}  // namespace rapid

#include "runtime/io/text_table.h"

#include <fmt/format.h>

#include "runtime/io/format.h"
#include "tests/files/temporary_folder.h"
#include "tests/io/random_points.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

Column<Token> column_of(const std::vector<std::string>& strings)
{
    std::vector<Token> tokens;
    for (const std::string& text : strings) tokens.push_back(token_of(text));
    return Column<Token>(std::span<const Token>(tokens));
}

}  // namespace

TEST_CASE("a table of strings is in the order of the points, not of the tokens", "[io][texts]")
{
    for (const char* first : {"late", "middle", "early"}) token_of(first);
    const TextTable table = text_table(column_of({"early", "middle", "early", "", "late"}));
    std::vector<std::string> strings;
    for (const Token text : table.strings) strings.emplace_back(text.text());
    CHECK(strings == std::vector<std::string>{"early", "middle", "", "late"});
    CHECK(same_bits(strings_at(table.strings, table.indices), column_of({"early", "middle", "early", "", "late"})));
    CHECK(text_table(Column<Token>(3, token_of("a"))).indices.is_uniform());
    CHECK(text_table(Column<Token>()).strings.empty());
}

TEST_CASE("an index of -1 is the empty string, and one beyond the table is an error", "[io][texts]")
{
    const std::vector<Token> strings = {token_of("leaf")};
    const auto column = [&](const std::vector<std::int32_t>& indices) {
        return strings_at(strings, Column<std::int32_t>(std::span<const std::int32_t>(indices)));
    };
    CHECK(same_bits(column({0, -1}), column_of({"leaf", ""})));
    CHECK(error_of([&] { column({0, 1}); }) == "a point has string number 1, but there are only 1");
    CHECK(error_of([&] { column({-2, 0}); }) == "a point has string number -2, but there are only 1");
}

TEST_CASE("texts of a file have the tokens of the process, also when more are met than are remembered", "[io][texts]")
{
    StringTokens token_of_word;
    for (int round = 0; round < 2; ++round)
        for (int k = 0; k < 70000; ++k) {
            std::string word = fmt::format("word {}", k);
            const Token token = token_of_word(word);
            word[0] = 'x';  // not stored
            REQUIRE(token == token_of(fmt::format("word {}", k)));
            REQUIRE(token_of_word(fmt::format("word {}", k)) == token);
        }
    CHECK(token_of_word("") == Token());
}

TEST_CASE("formats with strings return them; others skip them, and keep everything else", "[io][texts]")
{
    const PointSet points = random_points({.size = 300, .wide = false});
    int with_strings = 0;
    for (const Format& format : formats()) {
        if (!format.read || format.positions_only) continue;
        CAPTURE(format.extension);
        const TemporaryFolder folder;
        const std::filesystem::path file = folder.path() / ("a" + format.extension);
        write_points(file, points);
        CHECK(differing_columns(format.holds_strings ? points : without_strings(points), read_points(file)) == "");
        with_strings += format.holds_strings;
    }
    CHECK(with_strings == 6);
}

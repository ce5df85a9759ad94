#include "runtime/points/token.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <set>

#include "runtime/base/memory_budget.h"
#include "runtime/points/point_set.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

TEST_CASE("equal strings have one token, different ones differ, and the empty string is 0", "[points][token]")
{
    const Token leaf = token_of("leaf"), bark = token_of("bark");
    CHECK(leaf == token_of(std::string("le") + "af"));
    CHECK_FALSE(leaf == bark);
    CHECK(leaf.text() == "leaf");
    CHECK(bark.text() == "bark");
    CHECK(token_of("").number == 0);
    CHECK(Token().text() == "");
    CHECK(token_of_number(leaf.number) == leaf);
    CHECK_THAT(error_of([] { token_of_number(4'000'000'000); }),
               Catch::StartsWith("no string has the number 4000000000"));
}

TEST_CASE("a string is UTF-8 without zeros", "[points][token]")
{
    for (const char* right : {"\x7f", "\u00fc", "\u0800", "\ud7ff", "\ue000", "\uffff", "\U00010000", "\U0010ffff"})
        CHECK(token_of(right).text() == right);
    using namespace std::string_literals;
    for (const std::string& wrong :
         {"a\0b"s, "\x80"s, "\xc3"s, "\xc0\x80"s, "\xc1\xbf"s, "\xe0\x9f\xbf"s, "\xed\xa0\x80"s, "\xe2\x82"s,
          "\xf0\x8f\xbf\xbf"s, "\xf4\x90\x80\x80"s, "\xf8\x88\x80\x80\x80"s, "\xc3("s, "\xff"s}) {
        CAPTURE(wrong);
        CHECK_THAT(error_of([&] { token_of(wrong); }), Catch::Contains("is not valid UTF-8 without zero bytes"));
    }
}

TEST_CASE("threads with the same strings get the same tokens", "[points][token][threads]")
{
    constexpr std::size_t strings = 1000, calls = 64;
    std::vector<std::vector<Token>> tokens(calls, std::vector<Token>(strings));
    tbb::parallel_for(std::size_t{0}, calls, [&](std::size_t call) {
        for (std::size_t k = 0; k < strings; ++k) {
            const std::size_t text = (k * 7 + call * 13) % strings;
            tokens[call][text] = token_of(fmt::format("text {}", text));
            CHECK(tokens[call][text].text() == fmt::format("text {}", text));
        }
    });
    std::set<std::uint32_t> numbers;
    for (const Token token : tokens[0]) numbers.insert(token.number);
    CHECK(numbers.size() == strings);
    for (const auto& other : tokens) CHECK(other == tokens[0]);
}

TEST_CASE("endless strings are an error of memory, not the end of the process", "[points][token]")
{
    const MemoryBudget small(1);
    const std::string error = error_of([] {
        for (int k = 0; k < 10'000'000; ++k) token_of(fmt::format("one of too many texts, {}", k));
    });
    CHECK_THAT(error, Catch::Contains("different strings in attributes would need") &&
                          Catch::Contains("use numbers to tell points apart"));
}

TEST_CASE("the list of types gives columns, values, names and numbers of components", "[points][token]")
{
    const char* const names[] = {"float", "vec3", "int32", "int64", "quat", "string"};
    const std::size_t components[] = {1, 3, 1, 1, 4, 1};
    REQUIRE(std::size(names) == std::variant_size_v<AnyColumn>);
    for (std::size_t k = 0; k < std::size(names); ++k) {
        const AnyColumn column = column_of_type<AnyColumn>(k);
        CHECK(column.index() == k);
        CHECK(type_name(type_of(column)) == names[k]);
        CHECK(std::visit([]<class T>(const Column<T>&) { return components_of<T>; }, column) == components[k]);
    }
}

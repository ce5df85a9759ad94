// Numbers in JSON are read exactly as written, or refused.
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "runtime/base/checked_json.h"
#include "tests/test.h"

using namespace rapid;

namespace {

enum class Level : std::uint8_t { Low = 0, High = 255 };

// Returns true if a text is read as T exactly if its number permits. long double, which holds 64 bits, decides.
template <class T>
bool is_right(const std::string& text)
{
    const long double number = std::stold(text);
    const bool fits = number >= static_cast<long double>(std::numeric_limits<T>::lowest()) &&
                      number <= static_cast<long double>(std::numeric_limits<T>::max()) && number == std::trunc(number);
    try {
        const T read = SortedCheckedJson::parse(text).get<T>();
        return fits && static_cast<long double>(read) == number;
    } catch (const nlohmann::json::type_error&) {
        return !fits;
    }
}

}  // namespace

TEST_CASE("integers of JSON at the ends of their types, and beyond", "[json]")
{
    for (const char* text : {"0",
                             "-0.0",
                             "-1",
                             "1.0",
                             "1.5",
                             "2147483647",
                             "2147483648",
                             "-2147483648",
                             "-2147483649",
                             "4294967295",
                             "4294967296",
                             "4294967297",
                             "9223372036854775807",
                             "9223372036854775808",
                             "-9223372036854775808",
                             "9007199254740993",
                             "18446744073709551615",
                             "1e18",
                             "-1e18",
                             "1e30",
                             "-1e30",
                             "1e-300",
                             "255",
                             "256"}) {
        INFO(text);
        CHECK(is_right<std::int32_t>(text));
        CHECK(is_right<std::uint32_t>(text));
        CHECK(is_right<std::int64_t>(text));
        CHECK(is_right<std::uint64_t>(text));
        CHECK(is_right<std::uint8_t>(text));
    }
    CHECK(CheckedJson::parse("9223372036854775807.0").is_number_float());
    CHECK_THROWS_AS(CheckedJson::parse("9223372036854775807.0").get<std::int64_t>(), nlohmann::json::type_error);
    CHECK_THROWS_AS(CheckedJson::parse("18446744073709551616").get<std::uint64_t>(), nlohmann::json::type_error);
    CHECK(CheckedJson::parse("-9223372036854775808.0").get<std::int64_t>() == std::numeric_limits<std::int64_t>::min());
}

TEST_CASE("random numbers of JSON are read as they are or refused", "[json]")
{
    rc::prop("integers", [](std::int64_t number) {
        const std::string text = std::to_string(number);
        RC_ASSERT(is_right<std::int32_t>(text));
        RC_ASSERT(is_right<std::uint64_t>(text));
    });
    rc::prop("decimals", [](double number) {
        const std::string text = CheckedJson(number).dump();
        RC_ASSERT(is_right<std::int32_t>(text));
        RC_ASSERT(is_right<std::uint32_t>(text));
        RC_ASSERT(CheckedJson::parse(text).get<double>() == number);
    });
}

TEST_CASE("integers within lists, maps, enumerations and defaults are checked, too", "[json]")
{
    const auto json =
        CheckedJson::parse(R"({"list": [1, 2, 1e30], "map": {"a": 4294967296}, "level": 255, "on": true})");
    CHECK_THROWS_AS(json.at("list").get<std::vector<int>>(), nlohmann::json::type_error);
    CHECK(json.at("list").get<std::vector<double>>() == std::vector<double>{1, 2, 1e30});
    CHECK_THROWS_AS((json.at("map").get<std::map<std::string, int>>()), nlohmann::json::type_error);
    CHECK_THROWS_AS(json.at("map").value("a", 7), nlohmann::json::type_error);
    CHECK(json.at("map").value("b", 7) == 7);
    CHECK(json.at("level").get<Level>() == Level::High);
    CHECK(json.at("on").get<bool>());
    CHECK_THROWS_AS(json.at("on").get<int>(), nlohmann::json::type_error);
    CHECK(CheckedJson(Level::High).get<int>() == 255);
}

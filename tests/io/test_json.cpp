// Numbers in JSON are read exactly as written, or refused, and JsonText writes what nlohmann's library writes.
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "runtime/base/json.h"
#include "runtime/math/vec.h"
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

namespace {

std::string json_text_of(std::size_t indent)
{
    const std::optional<double> none;
    const std::variant<bool, std::string> either = "no \xff UTF-8";
    JsonText json(indent);
    json.begin_object();
    json.members("frame", 3, "P", Vec3f(0.1f, -2, 1e-8f), "nothing", nullptr, "none", none, "some",
                 std::optional(1e300));
    json.members("empty list", std::vector<int>(), "either", either, "text", std::string_view("a \"b\"\n"));
    json.key("empty");
    json.object();
    json.members("named", std::map<std::string, std::array<int, 2>>{{"a", {1, 2}}, {"b", {3, 4}}}, "not finite",
                 std::nan(""));
    json.list("rows", std::array{1, 2}, [&](int row) {
        json.object("row", row, "of", [&] { json.value(std::vector<std::vector<int>>{{}, {row}}); });
    });
    json.member("parsed", CheckedJson::parse(R"({"z": [1, {"y": {}}], "a": "x"})"));
    json.add_members(CheckedJson::parse(R"({"last": [], "of all": 1.5})"));
    json.end();
    return json.text();
}

}  // namespace

TEST_CASE("JSON of any values is laid out as nlohmann's library lays it out", "[json]")
{
    const CheckedJson parsed = CheckedJson::parse(json_text_of(0));
    CHECK(json_text_of(0) == parsed.dump());
    CHECK(json_text_of(1) == parsed.dump(1));
    CHECK(json_text_of(2) == parsed.dump(2));
    CHECK(json_text(parsed, 2) == parsed.dump(2));
}

TEST_CASE("JSON holds the values that were written", "[json]")
{
    const CheckedJson parsed = CheckedJson::parse(json_text_of(2));
    CHECK(parsed.at("P").get<std::vector<double>>() == std::vector<double>{0.1f, -2, 1e-8f});
    CHECK(parsed.at("some") == 1e300);
    for (const char* name : {"nothing", "none", "not finite"}) CHECK(parsed.at(name).is_null());
    CHECK(parsed.at("either") == "no \xef\xbf\xbd UTF-8");
    CHECK(parsed.at("text") == "a \"b\"\n");
    CHECK(parsed.at("named").at("b") == CheckedJson({3, 4}));
    CHECK(parsed.at("rows").at(1).at("of") == CheckedJson::parse("[[], [2]]"));
    CHECK(parsed.at("parsed").at("z").at(1).at("y").empty());
    CHECK(parsed.begin().key() == "frame");
    CHECK(std::prev(parsed.end()).key() == "of all");
}

TEST_CASE("a value that is JSON already is written as it is", "[json]")
{
    JsonText json;
    json.object("all", [&] {
        json.begin_list();
        for (const char* each : {R"({"x": 1})", "2"}) json.written(each);
        json.end();
    });
    CHECK(json.text() == R"({"all":[{"x": 1},2]})");
}

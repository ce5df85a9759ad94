// JsonText writes the same text as nlohmann's library for the same values.
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "runtime/base/json_text.h"
#include "runtime/math/vec.h"
#include "tests/test.h"

using namespace rapid;

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

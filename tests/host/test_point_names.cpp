// Compares the table of a point's names with the annotations and the columns of a set.
#include <fstream>
#include <regex>
#include <sstream>

#include "runtime/points/point_names.h"
#include "tests/test.h"

namespace rapid {

TEST_CASE("the annotations declare the methods of a point, and no other", "[point names]")
{
    std::ifstream file(std::string(RAPID_SOURCE_DIR) + "/lua/annotations.lua");
    std::stringstream text;
    text << file.rdbuf();
    const std::string annotations = text.str();
    const std::regex method("function Point:([a-z]+)\\(");
    std::vector<std::string> declared;
    for (std::sregex_iterator at(annotations.begin(), annotations.end(), method), end; at != end; ++at)
        declared.push_back((*at)[1]);
    CHECK(declared == point_names_of(PointName::Method));
}

TEST_CASE("the columns of an empty set have the types of the table", "[point names]")
{
    const PointSet points;
    for (const auto& [name, column] : points.columns()) {
        CAPTURE(name);
        REQUIRE(is_own_column(name));
        CHECK(find_point_name(name)->type == type_of(column));
    }
}

}  // namespace rapid

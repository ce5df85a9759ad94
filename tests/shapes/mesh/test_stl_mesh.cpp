// STL meshes of other programs.
#include <array>
#include <cstring>

#include "runtime/shapes/mesh/detailed_mesh.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

class StlFolder {
public:
    DetailedMeshPtr read(const std::string& bytes) const { return detailed(read_mesh(folder_.write("a.stl", bytes))); }
    // Returns the error without the file's name.
    std::string error(const std::string& bytes) const
    {
        std::string message = error_of([&] { read(bytes); });
        const std::string start = "cannot read the mesh \"" + (folder_ / "a.stl").string() + "\": ";
        REQUIRE(message.starts_with(start));
        return message.substr(start.size());
    }

private:
    TemporaryFolder folder_;
};

// Returns a binary file of right-angled triangles, one per colour.
std::string binary(std::string title, const std::vector<std::uint16_t>& colours)
{
    title.resize(80, ' ');
    const auto put = [&](const auto& number) { title.append(reinterpret_cast<const char*>(&number), sizeof number); };
    put(static_cast<std::uint32_t>(colours.size()));
    for (std::size_t k = 0; k < colours.size(); ++k) {
        const auto z = static_cast<float>(k);
        put(std::array<float, 12>{0, 0, 1, 0, 0, z, 1, 0, z, 0, 1, z});
        put(colours[k]);
    }
    return title;
}

std::string facet(const char* z)
{
    return std::string("facet normal 0 0 1\nouter loop\nvertex 0 0 ") + z + "\nvertex 1 0 " + z + "\nvertex 0 +1. " +
           z + "\nendloop\nendfacet\n";
}

std::string upper(std::string text)
{
    for (char& c : text) c = static_cast<char>(std::toupper(c));
    return text;
}

}  // namespace

TEST_CASE("an .stl is told to be binary or text by its contents, whatever its title says", "[mesh][stl]")
{
    const StlFolder folder;
    CHECK(folder.read(binary("solid of a binary file", {0, 0}))->area() == 1);
    CHECK(folder.read("solid\n" + facet("0") + facet("1") + "endsolid")->area() == 1);
    CHECK(folder.read("\xef\xbb\xbf\n solid\r\n" + facet("0") + "endsolid a\r\n")->area() == 0.5);
    CHECK(folder.read(upper("solid A\n" + facet("0") + "endsolid A\n"))->area() == 0.5);

    const auto trailing = folder.read(binary("made", {0, 0}) + "20 bytes of a footer");
    CHECK(trailing->area() == 1);
    CHECK(trailing->skipped == std::vector<std::string>{"not read: the 20 bytes after its 2 facets"});
    CHECK(folder.read(binary("solid", {0}) + std::string(20, 'x'))->area() == 0.5);
}

TEST_CASE("solids of an .stl are groups, and colours of its facets are read in both conventions", "[mesh][stl]")
{
    const StlFolder folder;
    const auto solids = folder.read("solid A b\n" + facet("0") + "endsolid\nsolid\n" + facet("1") +
                                    "endsolid\nsolid C\n" + facet("2") + facet("3") + "endsolid");
    const std::map<std::string, std::vector<std::uint8_t>> expected = {{"A b", {1, 0, 0, 0}}, {"C", {0, 0, 1, 1}}};
    CHECK(solids->face_groups == expected);

    const auto colours = [&](const std::string& title, const std::vector<std::uint16_t>& bits) {
        return std::get<std::vector<Vec3f>>(folder.read(binary(title, bits))->face_values.at("Cd"));
    };
    constexpr std::uint16_t marked = 1 << 15, high = 31 << 10;
    CHECK(colours("VisCAM", {marked | high, 0}) == std::vector<Vec3f>{{1, 0, 0}, Vec3f::Constant(0.6f)});
    CHECK(colours("COLOR=\xff" + std::string(1, '\0') + "\xff\xff Magics", {high, marked}) ==
          std::vector<Vec3f>{{0, 0, 1}, {1, 0, 1}});
    CHECK(folder.read(binary("plain", {0, 0}))->face_values.empty());
}

TEST_CASE("an .stl that is cut or damaged is an error that says how", "[mesh][stl]")
{
    const StlFolder folder;
    CHECK(folder.error("solid\n" + facet("0")) == "the file ends early: its last line is not \"endsolid\"");
    const std::string whole = binary("made", {0, 0});
    CHECK(folder.error(whole.substr(0, whole.size() - 1)) ==
          "the file ends early: its header announces 2 facets, but it contains 1");
    CHECK(folder.error("facet") ==
          "not an STL file: it is too short for a binary one, and does not begin with \"solid\"");
    CHECK(folder.error("solid\nfacet\nvertex 0 0 0\nvertex 1 0 0\nendfacet\nendsolid\n") ==
          "line 5: a facet ends after 2 vertices; it must have three");
    CHECK(folder.error("solid\nvertex 0 0 x\nendsolid\n") == "line 2: \"x\" is not a number");
}

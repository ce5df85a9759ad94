#include "runtime/shapes/mesh/gltf_attributes.h"

#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

class GltfFolder {
public:
    GltfAttributes read(const std::string& text) const { return read_gltf_attributes(folder_.write("a.gltf", text)); }

private:
    TemporaryFolder folder_;
};

// Returns a primitive whose attribute _HEAT is an accessor with this count, stride and offset, on a buffer of 12 bytes.
std::string heat(const std::string& count, const std::string& stride, const std::string& offset)
{
    return R"({"meshes": [{"primitives": [{"attributes": {"POSITION": 0, "_HEAT": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": )" +
           count + R"(, "type": "SCALAR"}], "bufferViews": [{"buffer": 0, "byteStride": )" + stride +
           R"(, "byteOffset": )" + offset +
           R"(}], "buffers": [{"uri": "data:application/octet-stream;base64,AAAAAAAAgD8AAABA"}]})";
}

}  // namespace

TEST_CASE("lists within lists in the place of glTF's meshes are an error, however deep", "[mesh][read]")
{
    const GltfFolder folder;
    const std::string deep = std::string(500000, '[') + std::string(500000, ']');
    CHECK_THAT(error_of([&] { folder.read(R"({"meshes": )" + deep + "}"); }),
               Catch::Matchers::StartsWith("its JSON is damaged: "));
    CHECK(folder.read(R"({"extras": )" + deep + "}").primitives.empty());
}

TEST_CASE("an accessor of glTF is read within its buffer, or refused", "[mesh][read]")
{
    const GltfFolder folder;
    const GltfAttributes attributes = folder.read(heat("3", "4", "0"));
    CHECK(std::get<std::vector<float>>(attributes.primitives.at(0).values.at("HEAT")) == std::vector<float>{0, 1, 2});

    for (const auto& [count, stride, offset] : {std::tuple{"4", "4", "0"},
                                                {"3", "4", "4"},
                                                {"3", "5", "0"},
                                                {"1", "4", "12"},
                                                {"1", "4", "13"},
                                                {"4611686018427387905", "4", "0"},
                                                {"2", "18446744073709551612", "8"},
                                                {"1", "4", "18446744073709551612"}})
        CHECK_THAT(error_of([&, &count = count, &stride = stride, &offset = offset] {
                       folder.read(heat(count, stride, offset));
                   }),
                   Catch::Matchers::Contains("goes beyond its buffer"));
}

// glTF files of other programs: accessors, nodes, skins, morph targets and animations.
#include "runtime/shapes/mesh/gltf_file.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstring>
#include <numbers>

#include "runtime/shapes/mesh/detailed_mesh.h"
#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;
using Catch::Matchers::Contains;

namespace {

constexpr int byte_type = 5121, short_type = 5123, signed_short_type = 5122, float_type = 5126;

// A document with one buffer, "a b.bin".
class Gltf {
public:
    template <class Number>
    int add(const std::vector<Number>& numbers, int component, const char* type, std::size_t count,
            const std::string& more = "")
    {
        buffer_.resize((buffer_.size() + 3) / 4 * 4, '\0');
        views_ += fmt::format("{}{{\"buffer\":0,\"byteOffset\":{}}}", separator(), buffer_.size());
        buffer_.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number));
        accessors_ += fmt::format(R"({}{{"bufferView":{},"componentType":{},"type":"{}","count":{}{}}})", separator(),
                                  count_, component, type, count, more);
        return count_++;
    }
    int add_floats(const std::vector<float>& numbers, const char* type, std::size_t numbers_a_value)
    {
        return add(numbers, float_type, type, numbers.size() / numbers_a_value);
    }

    // Members of the document after its buffer and accessors.
    std::filesystem::path write(const std::string& members) const
    {
        folder_.write("a b.bin", buffer_);
        return folder_.write("a.gltf", fmt::format(R"({{"asset":{{"version":"2.0"}},"buffers":[{{"uri":"a%20b.bin",)"
                                                   R"("byteLength":{}}}],"bufferViews":[{}],"accessors":[{}],{}}})",
                                                   buffer_.size(), views_, accessors_, members));
    }
    MeshFile read(const std::string& members) const { return read_mesh_file(write(members)); }
    std::string error(const std::string& members) const
    {
        return error_of([&] { read(members); });
    }

private:
    const char* separator() const { return count_ == 0 ? "" : ","; }

    TemporaryFolder folder_;
    std::string buffer_, views_, accessors_;
    int count_ = 0;
};

const std::vector<float> corners = {0, 0, 0, 1, 0, 0, 0, 1, 0};

// Returns a mesh with these attributes beside its positions, accessor 0, and a node.
std::string one_mesh(const std::string& attributes, const std::string& more = "",
                     const std::string& nodes = R"({"mesh":0})")
{
    return R"("nodes":[)" + nodes + R"(],"meshes":[{"primitives":[{"attributes":{"POSITION":0)" + attributes + "}" +
           more + "}]}]";
}

template <class T>
std::vector<T> values(const MeshFile& mesh, const char* name)
{
    return std::get<std::vector<T>>(mesh.values.at(name));
}

}  // namespace

TEST_CASE("normalized accessors are scaled, whatever their type", "[mesh][gltf]")
{
    Gltf gltf;
    gltf.add_floats(corners, "VEC3", 3);
    const std::string normalized = R"(,"normalized":true)";
    gltf.add(std::vector<std::uint16_t>{0, 0, 65535, 0, 0, 65535}, short_type, "VEC2", 3, normalized);
    gltf.add(std::vector<std::uint8_t>{0, 51, 255}, byte_type, "SCALAR", 3, normalized);
    gltf.add(std::vector<std::int16_t>{0, 0, 32767, 0, 0, -32767, 0, 0, -32768}, signed_short_type, "VEC3", 3,
             normalized);
    const MeshFile mesh = gltf.read(one_mesh(R"(,"TEXCOORD_0":1,"_WET":2,"NORMAL":3)") +
                                    R"(,"extensionsRequired":["KHR_mesh_quantization"])");
    // glTF counts v downwards.
    CHECK(values<Vec3f>(mesh, "uv") == std::vector<Vec3f>{{0, 1, 0}, {1, 1, 0}, {0, 0, 0}});
    CHECK(values<float>(mesh, "WET") == std::vector<float>{0, 0.2f, 1});
    CHECK(values<Vec3f>(mesh, "N") == std::vector<Vec3f>{{0, 0, 1}, {0, 0, -1}, {0, 0, -1}});
}

TEST_CASE("a colour of three components has the alpha 1, and parts without a colour are white", "[mesh][gltf]")
{
    Gltf gltf;
    gltf.add_floats(corners, "VEC3", 3);
    gltf.add(std::vector<std::uint8_t>{255, 0, 0, 0, 255, 0, 0, 0, 255}, byte_type, "VEC3", 3, R"(,"normalized":true)");
    gltf.add_floats({1, 1, 1, 0.5f, 1, 1, 1, 0.25f, 1, 1, 1, 1}, "VEC4", 4);
    const MeshFile mesh = gltf.read(R"("nodes":[{"mesh":0},{"mesh":1},{"mesh":2}],"meshes":[)"
                                    R"({"primitives":[{"attributes":{"POSITION":0}}]},)"
                                    R"({"primitives":[{"attributes":{"POSITION":0,"COLOR_0":1}}]},)"
                                    R"({"primitives":[{"attributes":{"POSITION":0,"COLOR_0":2}}]}])");
    CHECK(mesh.alphas == std::vector<float>{1, 1, 1, 1, 1, 1, 0.5f, 0.25f, 1});
    CHECK(mesh.colours[0] == Vec3f(1, 1, 1));
    CHECK(mesh.colours[4] == Vec3f(0, 1, 0));
}

TEST_CASE("a sparse accessor changes the values of its buffer, or zeros", "[mesh][gltf]")
{
    Gltf gltf;
    const std::string sparse = R"("sparse":{"count":1,"indices":{"bufferView":1,"componentType":5123},)"
                               R"("values":{"bufferView":2}})";
    gltf.add(corners, float_type, "VEC3", 3, "," + sparse);
    gltf.add(std::vector<std::uint16_t>{2}, short_type, "SCALAR", 1);
    gltf.add_floats({5, 6, 7}, "VEC3", 3);
    const MeshFile mesh = gltf.read(one_mesh(""));
    CHECK(mesh.positions == std::vector<Vec3f>{{0, 0, 0}, {1, 0, 0}, {5, 6, 7}});
}

TEST_CASE("triangle strips, fans and indices of a glTF file become triangles, and instances repeat them",
          "[mesh][gltf]")
{
    Gltf gltf;
    gltf.add_floats({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0}, "VEC3", 3);
    gltf.add(std::vector<std::uint8_t>{0, 1, 3, 2}, byte_type, "SCALAR", 4);
    gltf.add_floats({0, 0, 0, 10, 0, 0, 0, 20, 0}, "VEC3", 3);
    gltf.add_floats({1, 1, 1, 2, 1, 1, -1, 1, 1}, "VEC3", 3);
    const auto area = [](const MeshFile& file) { return joined(file, join_by_position(file.positions), "")->area(); };
    CHECK(area(gltf.read(one_mesh("", R"(,"mode":5)"))) == 1);
    CHECK(area(gltf.read(one_mesh("", R"(,"mode":6,"indices":1)"))) == 1);
    // The normals of a strip point the same way.
    for (const Mesh::Triangle& t : gltf.read(one_mesh("", R"(,"mode":5)")).triangles)
        CHECK((t == Mesh::Triangle(0, 1, 2) || t == Mesh::Triangle(2, 1, 3)));

    const std::string instanced =
        R"({"mesh":0,"translation":[0,0,5],"extensions":{"EXT_mesh_gpu_instancing":{"attributes":)"
        R"({"TRANSLATION":2,"SCALE":3}}}})";
    const MeshFile mesh = gltf.read(one_mesh("", R"(,"mode":5)", instanced));
    REQUIRE(mesh.positions.size() == 12);
    CHECK(mesh.positions[1] == Vec3f(1, 0, 5));
    CHECK(mesh.positions[5] == Vec3f(12, 0, 5));
    CHECK(mesh.positions[9] == Vec3f(-1, 20, 5));
    CHECK(mesh.triangles[4] == Mesh::Triangle(8, 10, 9));  // the last instance is mirrored
}

TEST_CASE("nodes of a glTF file place their meshes, and normals turn with them", "[mesh][gltf]")
{
    Gltf gltf;
    gltf.add_floats(corners, "VEC3", 3);
    gltf.add_floats({0, 0.6f, 0.8f, 0, 0.6f, 0.8f, 0, 0.6f, 0.8f}, "VEC3", 3);
    const double h = std::sqrt(0.5);
    const std::string nodes = fmt::format(
        R"({{"children":[1],"rotation":[0,0,{0},{0}]}},{{"mesh":0,"name":"sail","translation":[1,0,0],"scale":[1,2,1]}})",
        h);
    const MeshFile mesh = gltf.read(one_mesh(R"(,"NORMAL":1)", "", nodes));
    CHECK_THAT(mesh.positions[0], close_to(Vec3f{0, 1, 0}, 1e-6));
    CHECK_THAT(mesh.positions[2], close_to(Vec3f{-2, 1, 0}, 1e-6));
    const Vec3f N = Vec3f(-0.3f, 0, 0.8f).normalized();  // y is scaled by 1/2, then turned to -x
    CHECK_THAT(values<Vec3f>(mesh, "N")[0], close_to(N, 1e-6));
    CHECK(mesh.face_groups.at("sail") == std::vector<std::uint8_t>{1});
}

TEST_CASE("only the default scene of a glTF file is read", "[mesh][gltf]")
{
    Gltf gltf;
    gltf.add_floats(corners, "VEC3", 3);
    const std::string members = one_mesh("", "", R"({"mesh":0},{"mesh":0,"translation":[7,0,0]})");
    CHECK(gltf.read(members + R"(,"scene":1,"scenes":[{"nodes":[0]},{"nodes":[1]}])").positions[0].x() == 7);
    CHECK(gltf.read(members + R"(,"scenes":[{"nodes":[0]},{"nodes":[1]}])").positions[0].x() == 0);
    CHECK(gltf.read(members).positions.size() == 6);
}

TEST_CASE("what a glTF file gets wrong, or requires in vain, is an error that names it", "[mesh][gltf]")
{
    Gltf gltf;
    gltf.add_floats(corners, "VEC3", 3);
    gltf.add(std::vector<std::uint8_t>{0, 1, 9}, byte_type, "SCALAR", 3);
    CHECK_THAT(gltf.error(one_mesh("", R"(,"indices":1)")),
               Contains("a face has the vertex 9; the mesh has 3, numbered from 0"));
    CHECK_THAT(gltf.error(one_mesh("") + R"(,"extensionsRequired":["KHR_draco_mesh_compression"])"),
               Contains("it requires the extension \"KHR_draco_mesh_compression\", which can't be read"));
    CHECK(gltf.error(one_mesh("") + R"(,"extensionsRequired":["KHR_materials_unlit","KHR_texture_transform",)"
                                    R"("KHR_lights_punctual"])") == "");
    CHECK_THAT(gltf.error(one_mesh("", "", R"({"mesh":0,"children":[1]},{"children":[0]})")),
               Contains("a node is below itself"));
    CHECK_THAT(gltf.error(one_mesh("", "", R"({"children":[2]},{"children":[2]},{"mesh":0})")),
               Contains("node 2 has two parents"));
    CHECK_THAT(gltf.error(one_mesh("", "", R"({"mesh":1})")), Contains("a node has the mesh 1; there are 1, from 0"));
    CHECK_THAT(gltf.error(one_mesh(R"(,"NORMAL":7)")),
               Contains("it refers to accessor 7; there are 2, numbered from 0"));
    CHECK_THAT(gltf.error(one_mesh(R"(,"NORMAL":-1)")), Contains("it refers to accessor -1; there are 2"));
    CHECK_THAT(gltf.error(R"("meshes":[{}])"), Contains("it is incomplete: key 'primitives' not found"));

    const TemporaryFolder folder;
    const auto refusal = [&](const std::string& text) {
        return error_of([&, path = folder.write("b.gltf", text)] { read_mesh_file(path); });
    };
    CHECK_THAT(refusal(R"({"asset":{"version":"1.0"},"meshes":{"a":{}}})"),
               Contains("it is glTF 1.0, which can't be read; export glTF 2.0"));
    CHECK_THAT(
        refusal(R"({"buffers":[{"uri":"my%20data.bin"}],"bufferViews":[{"buffer":0}],"accessors":[{"bufferView":0,)"
                R"("componentType":5126,"count":1,"type":"VEC3"}],)" +
                one_mesh("") + "}"),
        Contains("its buffer \"my data.bin\" can't be read: No such file or directory"));
}

TEST_CASE("lists within lists in the place of glTF's meshes are an error, however deep", "[mesh][gltf]")
{
    const TemporaryFolder folder;
    const auto read = [&](const std::string& text) { read_gltf(folder.write("a.gltf", text)); };
    const std::string deep = std::string(500000, '[') + std::string(500000, ']');
    CHECK_THAT(error_of([&] { read(R"({"meshes": )" + deep + "}"); }),
               Catch::Matchers::StartsWith("its JSON is damaged: "));
    CHECK_THAT(error_of([&] { read(R"({"asset": {"version": )" + deep + "}}"); }),
               Catch::Matchers::StartsWith("its JSON is damaged: "));
    CHECK(error_of([&] { read(R"({"extras": )" + deep + "}"); }) == "");
}

TEST_CASE("glTF nodes may be nested 60,000 deep, and each moves those below it", "[mesh][gltf]")
{
    Gltf gltf;
    gltf.add_floats(corners, "VEC3", 3);
    constexpr int depth = 60000;
    std::string nodes;
    for (int k = 1; k < depth; ++k) nodes += fmt::format(R"({{"translation":[1,0,0],"children":[{}]}},)", k);
    const MeshFile mesh = gltf.read(one_mesh("", "", nodes + R"({"mesh":0})") + R"(,"scenes":[{"nodes":[0]}])");
    REQUIRE(mesh.positions.size() == 3);
    CHECK(mesh.positions[1] == Vec3f(depth, 0, 0));
}

TEST_CASE("an accessor of glTF is read within its buffer, or refused", "[mesh][gltf]")
{
    const TemporaryFolder folder;
    // A file whose attribute _HEAT is an accessor with this count, stride and offset, on a buffer of 12 bytes.
    const auto heat = [&](const std::string& count, const std::string& stride, const std::string& offset) {
        return read_gltf(
            folder.write("a.gltf",
                         R"({"meshes": [{"primitives": [{"attributes": {"POSITION": 0, "_HEAT": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": )" +
                             count + R"(, "type": "SCALAR"}], "bufferViews": [{"buffer": 0, "byteStride": )" + stride +
                             R"(, "byteOffset": )" + offset +
                             R"(}], "buffers": [{"uri": "data:application/octet-stream;base64,AAAAAAAAgD8AAABA"}]})"));
    };
    const GltfFile file = heat("3", "4", "0");
    CHECK(std::get<std::vector<float>>(file.meshes.at(0).primitives.at(0).values.at("HEAT")) ==
          std::vector<float>{0, 1, 2});

    for (const auto& [count, stride, offset] : {std::tuple{"4", "4", "0"},
                                                {"3", "4", "4"},
                                                {"3", "5", "0"},
                                                {"1", "4", "12"},
                                                {"1", "4", "13"},
                                                {"4611686018427387905", "4", "0"},
                                                {"2", "18446744073709551612", "8"},
                                                {"1", "4", "18446744073709551612"}})
        CHECK_THAT(error_of([&, &count = count, &stride = stride, &offset = offset] { heat(count, stride, offset); }),
                   Contains("goes beyond its buffer"));
}

namespace {

// Returns the attribute HEAT of a document whose accessor 0 has three numbers from view 0 on buffer 0.
std::vector<float> heat_of(const std::filesystem::path& path)
{
    return std::get<std::vector<float>>(read_gltf(path).meshes.at(0).primitives.at(0).values.at("HEAT"));
}
std::string heat_document(const std::string& buffer, const std::string& view = "")
{
    return R"({"meshes":[{"primitives":[{"attributes":{"POSITION":0,"_HEAT":0}}]}],"accessors":[{"bufferView":0,)"
           R"("componentType":5126,"count":3,"type":"SCALAR"}],"bufferViews":[{"buffer":0)" +
           view + R"(}],"buffers":[{)" + buffer + "}]}";
}

std::string bytes_of(const std::vector<float>& numbers)
{
    return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(float)};
}
std::string bytes_of(std::uint32_t number) { return {reinterpret_cast<const char*>(&number), sizeof number}; }

// Returns a binary file of a document and chunks of numbers. `after`: bytes behind its end.
std::string binary_gltf(std::string document, const std::vector<std::vector<float>>& chunks, const std::string& after)
{
    document.resize((document.size() + 3) / 4 * 4, ' ');
    std::string all = bytes_of(static_cast<std::uint32_t>(document.size())) + "JSON" + document;
    for (const std::vector<float>& chunk : chunks)
        all += bytes_of(static_cast<std::uint32_t>(chunk.size() * sizeof(float))) + std::string("BIN\0", 4) +
               bytes_of(chunk);
    return "glTF" + bytes_of(2) + bytes_of(static_cast<std::uint32_t>(12 + all.size())) + all + after;
}

}  // namespace

TEST_CASE("an accessor is within its buffer view, which is within its buffer, which has its length", "[mesh][gltf]")
{
    const TemporaryFolder folder;
    const auto error = [&](const std::string& length, const std::string& view) {
        const std::string uri = R"("uri":"data:;base64,AAAAAAAAgD8AAABA","byteLength":)" + length;
        return error_of([&, path = folder.write("a.gltf", heat_document(uri, view))] { read_gltf(path); });
    };
    CHECK(error("12", R"(,"byteLength":12)") == "");
    CHECK(error("12", R"(,"byteLength":11)") == "accessor 0 of 3 values goes beyond its buffer view 0");
    CHECK(error("12", R"(,"byteLength":13)") == "buffer view 0 goes beyond its buffer");
    CHECK(error("13", "") == "buffer 0 has 12 bytes; its byteLength is 13");
}

TEST_CASE("data URIs of glTF are base64 or bytes, and percent-encoded or not", "[mesh][gltf]")
{
    const TemporaryFolder folder;
    const auto heat = [&](const std::string& uri) {
        return heat_of(folder.write("a.gltf", heat_document(R"("uri":")" + uri + R"(","byteLength":12)")));
    };
    const std::vector<float> numbers = {0, 0.9f, 2};
    CHECK(heat("data:application/octet-stream;base64,AAAAAGZmZj8AAABA") == numbers);
    CHECK(heat("data:application/gltf-buffer;base64,%41AAAAGZmZj8AAAB%41") == numbers);
    CHECK(heat("data:application/octet-stream,%00%00%00%00fff%3F%00%00%00%40") == numbers);
    CHECK_THAT(error_of([&] { heat("data:application/octet-stream"); }), Contains("buffer 0 has a data URI without"));
}

TEST_CASE("the first binary chunk within the length of a .glb is its first buffer, unless that has a URI",
          "[mesh][gltf]")
{
    const TemporaryFolder folder;
    const std::vector<float> first = {1, 2, 3}, second = {4, 5, 6};
    const auto heat = [&](const std::string& buffer, const std::vector<std::vector<float>>& chunks,
                          const std::string& after) {
        return heat_of(folder.write("a.glb", binary_gltf(heat_document(buffer), chunks, after)));
    };
    CHECK(heat(R"("byteLength":12)", {first}, "") == first);
    CHECK(heat(R"("byteLength":12)", {first}, std::string(20, 'x')) == first);
    CHECK(heat(R"("byteLength":12)", {first, second}, "") == first);
    folder.write("a.bin", bytes_of(second));
    CHECK(heat(R"("uri":"a.bin","byteLength":12)", {first}, "") == second);
    CHECK_THAT(error_of([&] { heat(R"("byteLength":12)", {}, ""); }), Contains("key 'uri' not found"));
}

TEST_CASE("a skin moves vertices by the mean of their joints, and its node does not", "[mesh][gltf]")
{
    Gltf gltf;
    gltf.add_floats(corners, "VEC3", 3);
    gltf.add(std::vector<std::uint8_t>{0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0}, byte_type, "VEC4", 3);
    gltf.add_floats({1, 0, 0, 0, 1, 0, 0, 0, 0.25f, 0.75f, 0, 0}, "VEC4", 4);
    // The second joint was bound at (0, 0, 2).
    gltf.add_floats({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0,  1,  //
                     1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -2, 1},
                    "MAT4", 16);
    const std::string nodes = R"({"mesh":0,"skin":0,"translation":[100,0,0]},{"translation":[0,0,1],"children":[2]},)"
                              R"({"translation":[0,8,2]})";
    const MeshFile mesh = gltf.read(one_mesh(R"(,"JOINTS_0":1,"WEIGHTS_0":2)", "", nodes) +
                                    R"(,"skins":[{"joints":[1,2],"inverseBindMatrices":3}])");
    CHECK(mesh.positions[0] == Vec3f(0, 0, 1));
    CHECK(mesh.positions[1] == Vec3f(1, 8, 1));
    CHECK(mesh.positions[2] == Vec3f(0, 7, 1));
}

TEST_CASE("an animation moves nodes and morphs meshes continuously, by each of glTF's interpolations", "[mesh][gltf]")
{
    Gltf gltf;
    gltf.add_floats(corners, "VEC3", 3);
    gltf.add_floats({0, 0, 4, 0, 0, 4, 0, 0, 4}, "VEC3", 3);  // a morph target
    gltf.add_floats({1, 3}, "SCALAR", 1);                     // times
    gltf.add_floats({0, 0, 0, 6, 0, 0}, "VEC3", 3);           // translations
    const float h = std::sqrt(0.5f);
    gltf.add_floats({0, 0, 0, 1, 0, 0, h, h}, "VEC4", 4);                                // a quarter turn about z
    gltf.add_floats({0, 1}, "SCALAR", 1);                                                // weights
    gltf.add_floats({0, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 2, 0, 0, 0, 0, 0}, "VEC3", 3);  // a cubic from 0 to 2
    const auto file_with = [&](const std::string& path, int output, const char* interpolation) {
        return read_gltf(gltf.write(
            one_mesh("", R"(,"targets":[{"POSITION":1}])") +
            fmt::format(R"(,"animations":[{{"name":"go","samplers":[{{"input":2,"output":{},"interpolation":"{}"}}],)"
                        R"("channels":[{{"sampler":0,"target":{{"node":0,"path":"{}"}}}}]}}])",
                        output, interpolation, path)));
    };
    const auto corner = [&](const GltfFile& file, double time) {
        return posed(file, &file.animations.at(0), time).positions[1];
    };
    const GltfFile moved = file_with("translation", 3, "LINEAR");
    CHECK(posed(moved).positions[1] == Vec3f(1, 0, 0));
    for (const double time : {-1.0, 1.0, 1.5, 2.25, 3.0, 9.0}) {
        CAPTURE(time);
        const double s = std::clamp((time - 1) / 2, 0.0, 1.0);
        CHECK_THAT(corner(moved, time), close_to(Vec3f(static_cast<float>(1 + 6 * s), 0, 0), 1e-6));
        CHECK_THAT(corner(file_with("translation", 3, "STEP"), time), close_to(Vec3f(s < 1 ? 1 : 7, 0, 0), 0));
        const double angle = s * std::numbers::pi / 2;
        CHECK_THAT(corner(file_with("rotation", 4, "LINEAR"), time),
                   close_to(Vec3f(Vec3d(std::cos(angle), std::sin(angle), 0).cast<float>()), 1e-6));
        CHECK_THAT(corner(file_with("weights", 5, "LINEAR"), time),
                   close_to(Vec3f(1, 0, static_cast<float>(4 * s)), 1e-6));
        // Hermite's polynomial with the tangents 1 and 1 over two seconds.
        const double x = 2 * (s * s * s - 2 * s * s + s) + 2 * (3 * s * s - 2 * s * s * s) + 2 * (s * s * s - s * s);
        CHECK_THAT(corner(file_with("translation", 6, "CUBICSPLINE"), time),
                   close_to(Vec3f(static_cast<float>(1 + x), 0, 0), 1e-5));
    }
}

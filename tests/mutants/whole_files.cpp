#include "tests/mutants/whole_files.h"

#include <openvdb/io/File.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <functional>

#include "runtime/base/openvdb_grids.h"
#include "runtime/files/content_hash.h"
#include "runtime/io/format.h"
#include "runtime/io/state_file.h"
#include "runtime/points/state_archive.h"
#include "runtime/shapes/level_set/level_set.h"
#include "tests/io/points_with_trails.h"

namespace rapid::test {
namespace {

using Path = std::filesystem::path;

std::string written(const std::string& name, const std::function<void(const Path& path)>& write)
{
    const TemporaryFolder folder;
    write(folder / name);
    return file_text(folder / name);
}

// Writes a file in a separate process, whose memory is freed with it.
std::string written_sandboxed(const std::string& name, const std::function<void(const Path& path)>& write)
{
    return written(name, [&](const Path& path) {
        const pid_t child = ::fork();
        if (child == 0) {
            write(path);
            ::_exit(0);
        }
        ::waitpid(child, nullptr, 0);
    });
}

void write_level_set(const Path& path) { level_set_sphere(1, Vec3d::Zero(), {0.2, 3})->write(path, "surface"); }

void write_grid(const Path& path, const openvdb::GridBase::Ptr& grid, const char* name, std::uint32_t compression)
{
    grid->setName(name);
    openvdb::io::File file(path.string());
    file.setCompression(compression);
    file.write({grid});
}

void write_vectors(const Path& path, bool half)
{
    openvdb::initialize();
    const auto grid = openvdb::Vec3SGrid::create(openvdb::Vec3s(0, 1, 0));
    for (int i = 0; i < 20; ++i) grid->tree().setValue({i, 2 * i, 0}, openvdb::Vec3s(1, 2, static_cast<float>(i)));
    grid->setSaveFloatAsHalf(half);
    write_grid(path, grid, "v", openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
}
void write_vector_grid(const Path& path) { write_vectors(path, false); }
void write_half_vector_grid(const Path& path) { write_vectors(path, true); }

void write_density(const Path& path, std::uint32_t compression)
{
    openvdb::initialize();
    const auto grid = openvdb::FloatGrid::create();
    grid->tree().addTile(1, {64, 0, 0}, 0.5f, true);
    for (int i = 0; i < 20; ++i) grid->tree().setValue({i, 2 * i, 0}, static_cast<float>(i));
    write_grid(path, grid, "density", compression);
}
void write_fog(const Path& path)
{
    write_density(path, openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
}
void write_zipped_fog(const Path& path)
{
    write_density(path, openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK);
}
void write_plain_fog(const Path& path) { write_density(path, openvdb::io::COMPRESS_NONE); }

void write_state_of_points(const Path& path)
{
    write_state(path, {{"rapid", "0.1.0"}, {"frame", 12}}, state_of(random_points({.size = 40, .wide = false})));
}

void seal_state(std::string& mutant)
{
    if (mutant.size() < sizeof(std::uint64_t)) return;
    const std::size_t body = mutant.size() - sizeof(std::uint64_t);
    const std::uint64_t sum = content_hash(mutant.substr(0, body));
    std::memcpy(mutant.data() + body, &sum, sizeof sum);
}

// A tetrahedron.
constexpr const char* obj =
    "o t\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 1\nf 1 3 2\nf 1//1 2//1 4//1\nf 2 3 4\nf 3 1 4\n";
constexpr const char* lines = "# two\nv 0 0 0\nv 1 0 .5\nv 0 1e-3 0\nl 1 2 3\nv 4 4 4\nl -1 2/1 3/2/1\np 1 4\n";
constexpr const char* ply =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar "
    "red\n"
    "property uchar green\nproperty uchar blue\nelement face 3\nproperty list uchar int vertex_indices\nelement edge "
    "1\nproperty int vertex1\nproperty int vertex2\nend_header\n"
    "0 0 0 1 2 3\n1 0 0 4 5 6\n0 1 0 7 8 9\n0 0 1 1 1 1\n3 0 2 1\n4 0 1 2 3\n3 1 2 3\n0 001\n";
constexpr const char* vtp =
    "<VTKFile type=\"PolyData\" compressor=\"vtkZLibDataCompressor\"><PolyData><Piece NumberOfPoints=\"3\"><Point"
    "s><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"binary\">AQAAACQAAAAAAAAAHwAAAA==eJxjYACBBns"
    "g4QBEQNwAxAuA+AAQPwBiBkcAUQgFgQ==</DataArray></Points><PointData><DataArray type=\"Int16\" Name=\"kind\" for"
    "mat=\"ascii\">1 2 3</DataArray><DataArray type=\"Float32\" Name=\"v\" NumberOfComponents=\"3\" format=\"appe"
    "nded\" offset=\"0\"/></PointData></Piece></PolyData><AppendedData encoding=\"base64\">_AQAAACQAAAAAAAAAHwAAA"
    "A==eJxjYACBBnsg4QBEQNwAxAuA+AAQPwBiBkcAUQgFgQ==</AppendedData></VTKFile>";
constexpr const char* stl =
    "solid t\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nfacet "
    "normal 0 1 "
    "0\nouter loop\nvertex 0 0 0\nvertex 0 0 1\nvertex 1 0 0\nendloop\nendfacet\nendsolid\n";

std::string little(std::uint32_t word)
{
    return {static_cast<char>(word), static_cast<char>(word >> 8), static_cast<char>(word >> 16),
            static_cast<char>(word >> 24)};
}

// Two triangles.
std::string binary_stl()
{
    std::string text(80, ' ');
    text += little(2);
    for (int facet = 0; facet < 2; ++facet) {
        std::array<float, 12> numbers{0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, static_cast<float>(facet)};
        text.append(reinterpret_cast<const char*>(numbers.data()), sizeof numbers).append(2, '\0');
    }
    return text;
}

// A triangle: 36 bytes of positions and 6 of indices.
std::string gltf_json(const std::string& uri)
{
    return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"children":[1]},{"scale":[2,2,2],"mesh":0}],)"
           R"("meshes":[{"primitives":[{"attributes":{"POSITION":1},"indices":0}]}],"buffers":[{)" +
           uri +
           R"("byteLength":44}],"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":6,"target":34963},{"buffer":0,"byteOffset":8,"byteLength":36,"target":34962}],)"
           R"("accessors":[{"bufferView":0,"byteOffset":0,"componentType":5123,"count":3,"type":"SCALAR","max":[2],"min":[0]},)"
           R"({"bufferView":1,"byteOffset":0,"componentType":5126,"count":3,"type":"VEC3","max":[1,1,0],"min":[0,0,0]}]})";
}

std::string gltf()
{
    return gltf_json(
        R"("uri":"data:application/octet-stream;base64,AAABAAIAAAAAAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAAAAAAAAACAPwAAAAA=",)");
}

std::string glb()
{
    std::string json = gltf_json("");
    json.resize((json.size() + 3) / 4 * 4, ' ');
    std::string binary("\0\0\1\0\2\0\0\0", 8);
    const std::array<float, 9> P{0, 0, 0, 1, 0, 0, 0, 1, 0};
    binary.append(reinterpret_cast<const char*>(P.data()), sizeof P);
    const auto total = static_cast<std::uint32_t>(12 + 8 + json.size() + 8 + binary.size());
    return "glTF" + little(2) + little(total) + little(static_cast<std::uint32_t>(json.size())) + "JSON" + json +
           little(static_cast<std::uint32_t>(binary.size())) + std::string("BIN\0", 4) + binary;
}

// Returns files written by Rapid, in every point format that it reads.
std::vector<WholeFile> registered_formats()
{
    std::vector<WholeFile> files;
    for (const Format& format : formats()) {
        if (!format.read) continue;
        const std::string name = "a" + format.extension;
        const auto add = [&](const std::string& what, const PointSet& points) {
            files.push_back({"points " + format.extension + what, name,
                             written(name, [&](const Path& path) { write_points(path, points); }), content_of_points});
            files.back().may_end_at_any_line = format.lines_stand_alone;
            files.back().has_points = !points.empty();
        };
        add("", random_points({.size = 40, .wide = false}));
        add(", trails", points_with_trails(8));
        if (!format.positions_only) add(", no points", points_with_trails(0));
    }
    return files;
}

}  // namespace

WholeFile sparse_fog(int values)
{
    // Readers are copies of this process, and memory that it has freed is not counted by their limit.
    const auto write = [&](const Path& path) {
        openvdb::initialize();
        const auto grid = openvdb::FloatGrid::create();
        for (int i = 0; i < values; ++i) grid->tree().addTile(1, {i << 12, 0, 0}, 1.0f, true);
        write_grid(path, grid, "density", openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
    };
    return {"sparse fog .vdb", "a.vdb", written_sandboxed("a.vdb", write), content_of_fog};
}

std::vector<WholeFile> whole_files()
{
    std::vector<WholeFile> files = registered_formats();
    const auto add = [&](const char* reader, const char* name, const std::string& bytes, ContentOf content) {
        files.push_back({reader, name, bytes, content});
    };
    add("points .ply, ascii", "a.ply", ply, content_of_points);
    add("points .obj, by others", "a.obj", lines, content_of_points);
    files.back().may_end_at_any_line = true;
    add("points .vtp, text and base64", "a.vtp", vtp, content_of_points);
    add("mesh .ply", "a.ply", ply, content_of_mesh);
    add("mesh .obj", "a.obj", obj, content_of_mesh);
    files.back().may_end_anywhere = true;
    add("mesh .stl, ascii", "a.stl", stl, content_of_mesh);
    add("mesh .stl, binary", "a.stl", binary_stl(), content_of_mesh);
    add("mesh .gltf", "a.gltf", gltf(), content_of_mesh);
    add("mesh .glb", "a.glb", glb(), content_of_mesh);
    add("level set .vdb", "a.vdb", written("a.vdb", write_level_set), content_of_level_set);
    add("vector grid .vdb", "a.vdb", written("a.vdb", write_vector_grid), content_of_vector_grid);
    add("vector grid .vdb, half", "a.vdb", written("a.vdb", write_half_vector_grid), content_of_vector_grid);
    add("fog .vdb", "a.vdb", written("a.vdb", write_fog), content_of_fog);
    add("fog .vdb, zipped", "a.vdb", written("a.vdb", write_zipped_fog), content_of_fog);
    add("fog .vdb, not packed", "a.vdb", written("a.vdb", write_plain_fog), content_of_fog);
    add("state", "state", written("state", write_state_of_points), content_of_state);
    files.back().seal = seal_state;
    return files;
}

}  // namespace rapid::test

// Damaged files for every reader: each is read, or is an error that names the file. None ends the process by a signal,
// takes more than ten seconds of the processor, or more memory than the limit.
//
//   RAPID_MUTANTS=10000 build/test/bin/test_mutants       as many of each reader (1,000)
//   RAPID_MUTANT_SECONDS=3600 build/test/bin/test_mutants as long for each reader, at most (40)
//   RAPID_MUTANT_FIRST=2000 build/test/bin/test_mutants   from this one on (0), as far as RAPID_MUTANTS
//   RAPID_MUTANT_READER=.vdb build/test/bin/test_mutants  only readers with this in their names
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <functional>

#include "runtime/io/describe.h"
#include "runtime/io/format.h"
#include "runtime/io/state_file.h"
#include "runtime/points/state_archive.h"
#include "runtime/shapes/level_set/density_grid.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/level_set/vector_grid.h"
#include "runtime/shapes/mesh/mesh.h"
#include "tests/io/random_points.h"
#include "tests/mutants/mutate.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

namespace {

using Path = std::filesystem::path;

void use_points(const Path& path) { describe(read_points(path)); }
void use_mesh(const Path& path) { read_mesh(path)->openness(); }
void use_level_set(const Path& path)
{
    const LevelSetPtr shape = read_level_set(path, "");
    const Vec3d P(0.1, 0.2, 0.3);
    double distance;
    Vec3d gradient;
    shape->distance({&P, 1}, {&distance, 1}, {&gradient, 1});
}
void use_vector_grid(const Path& path)
{
    const Vec3d P(0.1, 0.2, 0.3);
    Vec3d value;
    read_vector_grid(path, "")->sample({&P, 1}, {&value, 1});
}

void use_density_grid(const Path& path)
{
    std::vector<Birthplace> births(10);
    read_density_grid(path, "")->scatter()->place(RandomKey(1, "a"), 0, births);
}

void use_state(const Path& path)
{
    PointSet points;
    try {
        restore(points, StateFile(path).state());
    } catch (Error& error) {
        throw error.at({path.string(), 0});  // as who asks for a snapshot does
    }
    describe(points);
}

// Writes a whole file of the format.
void write_points_of(const Path& path) { write_points(path, random_points({.size = 40, .wide = false})); }
void write_level_set(const Path& path) { level_set_sphere(1, Vec3d::Zero(), {0.2, 3})->write(path, "surface"); }

void write_state(const Path& path)
{
    OutputFile file(path);
    rapid::write_state(file, {{"rapid", "0.1.0"}, {"frame", 12}}, state_of(random_points({.size = 40, .wide = false})));
    file.finish();
}

void write_vector_grid(const Path& path)
{
    openvdb::initialize();
    const auto grid = openvdb::Vec3SGrid::create(openvdb::Vec3s(0, 1, 0));
    grid->setName("v");
    for (int i = 0; i < 20; ++i) grid->tree().setValue({i, 2 * i, 0}, openvdb::Vec3s(1, 2, static_cast<float>(i)));
    openvdb::io::File(path.string()).write({grid});
}

void write_density_grid(const Path& path)
{
    openvdb::initialize();
    const auto grid = openvdb::FloatGrid::create();
    grid->setName("density");
    grid->tree().addTile(1, {64, 0, 0}, 0.5f, true);
    for (int i = 0; i < 20; ++i) grid->tree().setValue({i, 2 * i, 0}, static_cast<float>(i));
    openvdb::io::File(path.string()).write({grid});
}

// A tetrahedron.
constexpr const char* obj =
    "o t\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 1\nf 1 3 2\nf 1//1 2//1 4//1\nf 2 3 4\nf 3 1 4\n";
constexpr const char* lines = "# two\nv 0 0 0\nv 1 0 .5\nv 0 1e-3 0\nl 1 2 3\nv 4 4 4\nl -1 2/1 3/2/1\np 1 4\n";
constexpr const char* ply =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar "
    "red\n"
    "property uchar green\nproperty uchar blue\nelement face 3\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0 1 2 3\n1 0 0 4 5 6\n0 1 0 7 8 9\n0 0 1 1 1 1\n3 0 2 1\n4 0 1 2 3\n3 1 2 3\n";
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
    "0\nouter loop\nvertex 0 0 0\nvertex 0 0 1\nvertex 1 0 0\nendloop\nendfacet\nendsolid t\n";

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

std::string little(std::uint32_t word)
{
    return {static_cast<char>(word), static_cast<char>(word >> 8), static_cast<char>(word >> 16),
            static_cast<char>(word >> 24)};
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

struct Reader {
    std::string name, file;
    std::string whole;  // or else
    void (*write)(const Path& path) = nullptr;
    void (*use)(const Path& path);
};

const std::vector<Reader>& readers()
{
    static const std::vector<Reader> all = {
        {"points .csv", "a.csv", "", write_points_of, use_points},
        {"points .bgeo", "a.bgeo", "", write_points_of, use_points},
        {"points .ply, binary", "a.ply", "", write_points_of, use_points},
        {"points .ply, ascii", "a.ply", ply, nullptr, use_points},
        {"points .vdb", "a.vdb", "", write_points_of, use_points},
        {"points .npz", "a.npz", "", write_points_of, use_points},
        {"points .prt", "a.prt", "", write_points_of, use_points},
        {"points .usda", "a.usda", "", write_points_of, use_points},
        {"points .obj", "a.obj", lines, nullptr, use_points},
        {"points .vtp, raw", "a.vtp", "", write_points_of, use_points},
        {"points .vtp, text and base64", "a.vtp", vtp, nullptr, use_points},
        {"mesh .ply", "a.ply", ply, nullptr, use_mesh},
        {"mesh .obj", "a.obj", obj, nullptr, use_mesh},
        {"mesh .stl", "a.stl", stl, nullptr, use_mesh},
        {"mesh .gltf", "a.gltf", gltf(), nullptr, use_mesh},
        {"mesh .glb", "a.glb", glb(), nullptr, use_mesh},
        {"level set .vdb", "a.vdb", "", write_level_set, use_level_set},
        {"vector grid .vdb", "a.vdb", "", write_vector_grid, use_vector_grid},
        {"fog .vdb", "a.vdb", "", write_density_grid, use_density_grid},
        {"state", "state", "", write_state, use_state},
    };
    return all;
}

int setting(const char* name, int usual)
{
    const char* text = std::getenv(name);
    return text ? std::atoi(text) : usual;
}

// What the process that reads the mutants tells: how far it is, and what was wrong.
struct Report {
    int mutant, read, refused;
    char wrong[1000];
};

// Ten seconds of the processor for the next file; on a machine that has other work, more by the clock. A process in
// which a library reads has its own limit, which is lower.
void limit_time()
{
    const itimerval processor{{0, 0}, {10, 0}};
    ::setitimer(ITIMER_PROF, &processor, nullptr);
    ::alarm(120);
}

// Reads mutants until their number or their time is up, or one is wrong.
void read_mutants(const Reader& reader, const std::string& whole, const Path& path, Report& report)
{
    const int mutants = setting("RAPID_MUTANTS", 1000);
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(setting("RAPID_MUTANT_SECONDS", 40));
    for (; report.mutant < mutants && std::chrono::steady_clock::now() < end; ++report.mutant) {
        std::ofstream(path, std::ios::binary) << Mutator(static_cast<std::uint64_t>(report.mutant))(whole);
        std::string wrong;
        limit_time();
        try {
            reader.use(path);
            ++report.read;
        } catch (const Error& error) {
            ++report.refused;
            if (std::string(error.what()).find(path.string()) == std::string::npos)
                wrong = std::string("the error names no file: ") + error.what();
        } catch (const std::exception& error) {
            wrong = std::string("no error of Rapid's: ") + error.what();
        }
        if (wrong.empty()) continue;
        wrong.copy(report.wrong, sizeof report.wrong - 1);
        return;
    }
}

void limit_memory()
{
    constexpr std::size_t most = std::size_t{2} << 30;
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const rlim_t bytes = pages * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)) + most;
    const rlimit value{bytes, bytes};
    ::setrlimit(RLIMIT_AS, &value);
}

}  // namespace

TEST_CASE("a damaged file is read, or is an error that names it: no signal, no hang, no flood of memory",
          "[mutants][long]")
{
    const Reader& reader = GENERATE(from_range(readers()));
    const char* const which = std::getenv("RAPID_MUTANT_READER");
    if (which && reader.name.find(which) == std::string::npos) return;
    const TemporaryFolder folder;
    if (reader.write) reader.write(folder / ("whole-" + reader.file));
    const std::string whole = reader.write ? file_text(folder / ("whole-" + reader.file)) : reader.whole;
    std::ofstream(folder / reader.file, std::ios::binary) << whole;
    CAPTURE(reader.name);
    REQUIRE(error_of([&] { reader.use(folder / reader.file); }).empty());

    auto* report = static_cast<Report*>(
        ::mmap(nullptr, sizeof(Report), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
    report->mutant = setting("RAPID_MUTANT_FIRST", 0);
    const pid_t child = ::fork();
    if (child == 0) {
        for (const int signal : {SIGSEGV, SIGABRT, SIGFPE, SIGILL, SIGBUS, SIGALRM, SIGPROF}) ::signal(signal, SIG_DFL);
        limit_memory();
        read_mutants(reader, whole, folder / reader.file, *report);
        ::_exit(0);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    CAPTURE(report->mutant, report->read, report->refused, std::string(report->wrong));
    CHECK(status == 0);
    CHECK(report->wrong[0] == '\0');
    if (std::getenv("RAPID_MUTANTS"))
        std::printf("%s: as far as %d, %d read, %d refused\n", reader.name.c_str(), report->mutant, report->read,
                    report->refused);
    CHECK(report->refused > 0);
    ::munmap(report, sizeof(Report));
}

// Writing a million points of 32 bytes (P, v, int64 id) in each format, compared with the machine's limit (the same
// bytes from one interleaved array) and with OpenVDB's own tools. The files are in memory, so the disk does not count.
#include <benchmark/benchmark.h>
#include <fcntl.h>
#include <openvdb/points/PointConversion.h>
#include <openvdb/points/PointDataGrid.h>
#include <openvdb/tools/PointIndexGrid.h>
#include <unistd.h>

#include <filesystem>
#include <random>
#include <vector>

#include "runtime/base/openvdb_grids.h"
#include "runtime/io/format.h"
#include "runtime/picture/picture.h"

namespace {

using namespace rapid;

constexpr std::size_t count = 1'000'000;

const PointSet& million()
{
    static const PointSet points = [] {
        std::mt19937 random(1);
        std::normal_distribution<float> normal;
        PointSet made;
        made.append(count);
        std::span<Vec3f> P = made.P().overwrite(), v = made.v().overwrite();
        std::span<std::int64_t> id = made.id().overwrite();
        for (std::size_t i = 0; i < count; ++i) {
            P[i] = Vec3f(normal(random), normal(random), normal(random));
            v[i] = Vec3f(normal(random), normal(random), normal(random));
            id[i] = static_cast<std::int64_t>(i);
        }
        return made;
    }();
    return points;
}

std::filesystem::path scratch(const std::string& name)
{
    const std::filesystem::path memory = "/dev/shm";
    const std::filesystem::path folder =
        std::filesystem::is_directory(memory) ? memory : std::filesystem::temp_directory_path();
    return folder / ("rapid-bench-" + std::to_string(getpid()) + name);
}

void raw_interleaved(benchmark::State& state)
{
    const std::vector<char> bytes(32 * count, 1);
    const std::filesystem::path path = scratch(".raw");
    for (auto _ : state) {
        const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
        for (std::size_t at = 0; at < bytes.size();)
            at += static_cast<std::size_t>(std::max<ssize_t>(0, write(file, bytes.data() + at, bytes.size() - at)));
        close(file);
    }
    std::filesystem::remove(path);
    state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * count));
}
BENCHMARK(raw_interleaved)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();

// OpenVDB's own tools on the same arrays: an index, a grid, attributes and a file packed with Blosc.
void bare_openvdb(benchmark::State& state)
{
    namespace vdb = openvdb;
    using vdb::points::PointDataGrid;
    vdb::initialize();
    const PointSet& points = million();
    const std::filesystem::path path = scratch(".bare.vdb");
    std::vector<vdb::Vec3s> P(count), v(count);
    std::vector<std::int64_t> id(count);
    for (std::size_t i = 0; i < count; ++i) {
        P[i] = vdb::Vec3s(points.P()[i].data());
        v[i] = vdb::Vec3s(points.v()[i].data());
        id[i] = points.id()[i];
    }
    for (auto _ : state) {
        const vdb::points::PointAttributeVector<vdb::Vec3s> positions(P), velocities(v);
        const vdb::points::PointAttributeVector<std::int64_t> ids(id);
        const auto transform =
            vdb::math::Transform::createLinearTransform(vdb::points::computeVoxelSize(positions, 2048 / 512));
        const auto index = vdb::tools::createPointIndexGrid<vdb::tools::PointIndexGrid>(positions, *transform);
        const auto grid =
            vdb::points::createPointDataGrid<vdb::points::NullCodec, PointDataGrid>(*index, positions, *transform);
        vdb::points::appendAttribute<vdb::Vec3s>(grid->tree(), "v");
        vdb::points::populateAttribute(grid->tree(), index->tree(), "v", velocities);
        vdb::points::appendAttribute<std::int64_t>(grid->tree(), "id");
        vdb::points::populateAttribute(grid->tree(), index->tree(), "id", ids);
        vdb::io::File file(path.string());
        file.setCompression(vdb::io::COMPRESS_BLOSC | vdb::io::COMPRESS_ACTIVE_MASK);
        file.write({grid});
    }
    state.counters["bytes"] = static_cast<double>(std::filesystem::file_size(path));
    std::filesystem::remove(path);
    state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * count));
}
BENCHMARK(bare_openvdb)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();

void write_format(benchmark::State& state, const std::string& extension)
{
    const std::filesystem::path path = scratch(extension);
    for (auto _ : state) write_points(path, million());
    state.counters["bytes"] = static_cast<double>(std::filesystem::file_size(path));
    std::filesystem::remove(path);
    state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * count));
}
BENCHMARK_CAPTURE(write_format, vdb, ".vdb")->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(write_format, bgeo, ".bgeo")->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(write_format, ply, ".ply")->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(write_format, npz, ".npz")->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(write_format, prt, ".prt")->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(write_format, usda, ".usda")->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(write_format, vtp, ".vtp")->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(write_format, csv, ".csv")->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(write_format, png, ".png")->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();

void read_format(benchmark::State& state, const std::string& extension)
{
    const std::filesystem::path path = scratch(extension);
    write_points(path, million());
    for (auto _ : state) benchmark::DoNotOptimize(read_points(path).size());
    std::filesystem::remove(path);
    state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * count));
}
BENCHMARK_CAPTURE(read_format, vdb, ".vdb")->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(read_format, bgeo, ".bgeo")->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(read_format, ply, ".ply")->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(read_format, npz, ".npz")->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(read_format, prt, ".prt")->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(read_format, usda, ".usda")->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(read_format, vtp, ".vtp")->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();
BENCHMARK_CAPTURE(read_format, csv, ".csv")->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();

}  // namespace

#include "tests/mutants/contents.h"

#include <array>
#include <span>
#include <variant>

#include "runtime/files/skipped_contents.h"
#include "runtime/io/compare.h"
#include "runtime/io/format.h"
#include "runtime/io/state_file.h"
#include "runtime/points/state_archive.h"
#include "runtime/shapes/level_set/grid_file.h"
#include "runtime/shapes/level_set/level_set.h"
#include "runtime/shapes/level_set/level_set_grid.h"
#include "runtime/shapes/level_set/open_grids.h"
#include "runtime/shapes/mesh/mesh_file.h"

namespace rapid::test {
namespace {

class Content {
public:
    const std::string& bytes() const { return bytes_; }

    void add(std::string_view text) { add_bytes(text.data(), text.size()), bytes_ += '\0'; }
    template <class T>
    void add(std::span<const T> values)
    {
        add_bytes(values.data(), values.size_bytes());
    }
    template <class T>
    void add(const std::vector<T>& values)
    {
        add(std::span<const T>(values));
    }
    void add(const SkippedContents& skipped)
    {
        for (const std::string& what : skipped.list()) add(what);
    }
    void add(const PointSet& points)
    {
        for (const auto& [name, column] : points.columns()) {
            add(name);
            std::visit([&](const auto& values) { add_column(values); }, column);
        }
        for (const auto& [name, members] : points.groups()) add(name), add_column(members);
    }
    void add(const std::map<std::string, Mesh::VertexValues>& values)
    {
        for (const auto& [name, any] : values) add(name), std::visit([&](const auto& list) { add(list); }, any);
    }

private:
    void add_bytes(const void* from, std::size_t bytes) { bytes_.append(static_cast<const char*>(from), bytes); }
    template <class T>
    void add_column(const Column<T>& column)
    {
        for (std::size_t i = 0; i < column.size(); ++i)
            if constexpr (std::is_same_v<T, Token>)
                add(column[i].text());
            else
                add_bytes(&column[i], sizeof(T));
    }

    std::string bytes_;
};

template <class Grid>
std::string content_of(const Grid& grid)
{
    static std::array<unsigned char, std::size_t{64} << 20> room;
    MessageWriter message(room);
    send_grid<Grid>(std::const_pointer_cast<Grid>(grid.copy()), message);
    return {room.begin(), room.begin() + static_cast<std::ptrdiff_t>(message.bytes())};
}

}  // namespace

std::string content_of_points(const std::filesystem::path& path)
{
    const SkippedContents skipped;
    const PointSet points = read_points(path);
    describe(points);
    Content content;
    content.add(points);
    content.add(skipped);
    return content.bytes();
}

std::string content_of_mesh(const std::filesystem::path& path)
{
    const MeshFile mesh = read_mesh_file(path);
    joined(mesh, join_by_position(mesh.positions), path.string())->openness();
    Content content;
    content.add(mesh.positions);
    content.add(mesh.colours);
    content.add(mesh.alphas);
    content.add(mesh.values);
    content.add(mesh.triangles);
    content.add(mesh.face_values);
    for (const auto& [name, members] : mesh.face_groups) content.add(name), content.add(members);
    for (const std::string& what : mesh.skipped) content.add(what);
    return content.bytes();
}

std::string content_of_level_set(const std::filesystem::path& path)
{
    const LevelSetPtr shape = read_level_set(path, "");
    const Vec3d P(0.1, 0.2, 0.3);
    double distance;
    Vec3d gradient;
    shape->distance({&P, 1}, {&distance, 1}, {&gradient, 1});
    return content_of(grid_of(dynamic_cast<const BakedLevelSet&>(*shape)));
}

std::string content_of_vector_grid(const std::filesystem::path& path)
{
    const VectorGridPtr grid = read_vector_grid(path, "");
    const Vec3d P(0.1, 0.2, 0.3);
    Vec3d value;
    grid->sample({&P, 1}, {&value, 1});
    return content_of(*dynamic_cast<const OpenVectorGrid&>(*grid).grid());
}

std::string content_of_fog(const std::filesystem::path& path)
{
    const DensityGridPtr grid = read_density_grid(path, "");
    std::vector<Birthplace> births(10);
    grid->scatter()->place(RandomKey(1, "a"), 0, births);
    return content_of(*dynamic_cast<const OpenDensityGrid&>(*grid).grid());
}

std::string content_of_state(const std::filesystem::path& path)
{
    PointSet points;
    try {
        restore(points, StateFile(path).state());
    } catch (Error& error) {
        throw error.at({path.string(), 0});  // as the caller that reads a snapshot does
    }
    describe(points);
    Content content;
    content.add(points);
    return content.bytes();
}

}  // namespace rapid::test

// rapid.points: point sets that are read or generated.
#include <fmt/format.h>

#include <algorithm>

#include "bindings/host/makers/file_axes.h"
#include "bindings/host/makers/sequence_options.h"
#include "runtime/base/memory_budget.h"
#include "runtime/files/frame_pattern.h"
#include "runtime/files/skipped_contents.h"
#include "runtime/graph/points_object.h"
#include "runtime/io/format.h"

namespace rapid {
namespace {

// Numbers the points with ids from 0 in order.
ObjectPtr numbered(PointSet points)
{
    auto object = std::make_shared<PointsObject>();
    const std::span<std::int64_t> id = points.id().overwrite();
    for (std::size_t i = 0; i < id.size(); ++i) id[i] = static_cast<std::int64_t>(i);
    object->points = std::move(points);
    return object;
}

struct ReadPoints : SequenceOptions, FileAxes {
    std::string path;
    std::optional<double> frame;  // the frame of a sequence, requested by lua/rapid.lua

    static Maker declare()
    {
        auto declaration = maker<ReadPoints>(
            "points.read", "Reads points from a file of any format that Rapid reads, or from a sequence.");
        declaration
            .param(&ReadPoints::path, "path", Value(), any_number(), "",
                   "path, relative to the graph file; with #### or $F4 a file for each frame, and the result is a "
                   "function of the frame")
            .required();
        declaration.param(&ReadPoints::frame, "frame", Value(), any_number(), "", "frame of a sequence").internal();
        FileAxes::declare(declaration);
        return SequenceOptions::declare(declaration);
    }
    ObjectPtr make(MakeContext& context) const
    {
        check(path, frame.has_value());
        if (!frame) return read(context.resolve(path), context);
        const auto pattern = FramePattern::of_files(context.folder / path);
        const auto files = existing_files(pattern);
        if (const auto file = file_at(pattern, files, *frame)) return read(context.resolve(file->string()), context);
        // A frame without points still has the attributes of the other frames.
        auto none = std::make_shared<PointsObject>();
        const ObjectPtr first = read(context.resolve(files.begin()->second.string()), context);
        none->points = static_cast<const PointsObject&>(*first).points.select({});
        return none;
    }

private:
    // Reads points. The file's ids identify the same points in other files; without ids their order does.
    ObjectPtr read(const std::filesystem::path& file, MakeContext& context) const
    {
        const SkippedContents skipped;
        PointSet points = read_points(file);
        check_finite(points, file);
        apply(points);
        for (const std::string& what : skipped.list())
            context.warnings.push_back(fmt::format("rapid.points.read: \"{}\": {}", file.string(), what));
        if (!has_ids(points)) return numbered(std::move(points));
        auto object = std::make_shared<PointsObject>();
        object->points = std::move(points);
        return object;
    }

    static void check_finite(const PointSet& points, const std::filesystem::path& file)
    {
        for (const auto& [name, column] : {std::pair("P", &points.P()), std::pair("v", &points.v())})
            for (std::size_t i = 0; i < points.size(); ++i)
                if (const Vec3f& value = (*column)[i]; !value.allFinite())
                    throw Error(
                        fmt::format("\"{}\": the point in row {}, with id {}, has {} = {{{}, {}, {}}}; it must "
                                    "be finite",
                                    file.string(), i + 1, points.id()[i], name, value.x(), value.y(), value.z()));
    }

    // Returns true if every point has a unique id.
    static bool has_ids(const PointSet& points)
    {
        std::vector<std::int64_t> ids(points.size());
        for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = points.id()[i];
        std::sort(ids.begin(), ids.end());
        return !ids.empty() && ids.front() >= 0 && std::adjacent_find(ids.begin(), ids.end()) == ids.end();
    }
};
RAPID_MAKER(ReadPoints);

struct GridPoints {
    Vec3d size, center;
    double spacing;

    static Maker declare()
    {
        return maker<GridPoints>("points.grid", "Returns points at the centres of the cells of a box.")
            .param(&GridPoints::size, "size", Vec3d(1, 1, 1), any_number(), "m", "full edge lengths")
            .param(&GridPoints::spacing, "spacing", 0.1, above(0), "m", "edge of a cell")
            .param(&GridPoints::center, "center", Vec3d(0, 0, 0), any_number(), "m", "centre");
    }
    ObjectPtr make(MakeContext&) const
    {
        // An edge shorter than the spacing gives one layer. A ratio just below a whole number is rounded up to it.
        const auto along = [this](int axis) { return std::max(1.0, std::floor(size[axis] / spacing * (1 + 1e-9))); };
        if (!(size.minCoeff() >= 0))
            throw Error(fmt::format("size = {}: each edge must be at least 0", describe(Value(size))));
        const double nx = along(0), ny = along(1), nz = along(2);
        if (!(nx * ny * nz <= 2147483648.0))
            throw Error(fmt::format("size {} with spacing {} would make {:.3g} points; at most 2^31 are possible",
                                    describe(Value(size)), spacing, nx * ny * nz));
        constexpr double bytes_per_point =
            2 * (sizeof(Vec3f) + sizeof(Vec3f) + sizeof(std::int64_t));  // with the state
        if (const double bytes = nx * ny * nz * bytes_per_point; !fits_in_memory(bytes))
            throw memory_exceeded(
                fmt::format("size {} with spacing {}: {:.3g} points", describe(Value(size)), spacing, nx * ny * nz),
                bytes, "give a larger spacing");
        PointSet points;
        points.append(static_cast<std::size_t>(nx * ny * nz));
        const std::span<Vec3f> P = points.P().overwrite();
        const Vec3d corner = center - 0.5 * spacing * Vec3d(nx - 1, ny - 1, nz - 1);
        std::size_t i = 0;
        for (double x = 0; x < nx; ++x)
            for (double y = 0; y < ny; ++y)
                for (double z = 0; z < nz; ++z) P[i++] = (corner + spacing * Vec3d(x, y, z)).cast<float>();
        return numbered(std::move(points));
    }
};
RAPID_MAKER(GridPoints);

struct PointsFrom {
    std::map<std::string, Value> columns;

    static Maker declare()
    {
        return maker<PointsFrom>("points.from", "Returns points from lists of values by attribute.")
            .param(&PointsFrom::columns, "columns", Value(), any_number(), "",
                   "lists of values by attribute, { P = {{x, y, z}, ...}, ANY = {...} }")
            .required();
    }

    ObjectPtr make(MakeContext&) const
    {
        const auto place = columns.find("P");
        if (place == columns.end()) throw Error("P is missing; give P = {{x, y, z}, ...}");
        PointSet points;
        const std::vector<Vec3f> P = vectors("P", place->second);
        points.append(P.size());
        points.P() = Column<Vec3f>(P);
        for (const auto& [name, value] : columns) {
            if (name == "P") continue;
            if (name == "id") throw Error("id can't be given; ids count from 0");
            const Table* table = value.table();
            if (!table || table->list.size() != P.size())
                throw Error(fmt::format("{} has {}; it must be a list of {} values, like P", name,
                                        table ? fmt::format("{} values", table->list.size()) : describe(value),
                                        P.size()));
            if (name == "v")
                points.v() = Column<Vec3f>(vectors("v", value));
            else
                add_column(points, name, table->list);
        }
        return numbered(std::move(points));
    }

    static std::vector<Vec3f> vectors(const std::string& name, const Value& list)
    {
        Param param;
        param.name = name;
        param.type = "list of {x, y, z}";
        std::vector<Vec3f> result;
        read_value(param, list, result);
        return result;
    }

    // The first value decides the column's type.
    static void add_column(PointSet& points, const std::string& name, const std::vector<Value>& list)
    {
        Param param;
        param.name = name;
        AttributeValue value = 0.0f;
        if (!list.empty()) read_value(param, list.front(), value);
        std::visit(
            [&](const auto& first) {
                using T = std::decay_t<decltype(first)>;
                Column<T> column;
                const std::span<T> values = column.append_for_writing(list.size());
                for (std::size_t i = 0; i < list.size(); ++i) {
                    AttributeValue given;
                    read_value(param, list[i], given);
                    const T* same = std::get_if<T>(&given);
                    if (!same)
                        throw Error(fmt::format("{}[{}] is {}; it must be a {}, like the first", name, i + 1,
                                                describe(list[i]), type_name(type_of(AttributeValue(first)))));
                    values[i] = *same;
                }
                points.set(name, std::move(column));
            },
            AttributeValue(value));
    }
};
RAPID_MAKER(PointsFrom);

}  // namespace
}  // namespace rapid

// .obj: Wavefront's text format, as lines.
//
//   v x y z       each point, followed by the positions of trails
//   p 1 2 ...     points on no line, if there are lines
//   l 1 7 8 ...   a line: a trail, from the point itself backwards, or a curve (points/trail.h)
//
// It stores only positions, without velocities, attributes and groups. From any .obj file, the vertices of its lines
// are read as points in line order, with the index of the line as the attribute `curve`, from 0; then its points, with
// -1. If there are no lines, all vertices are read, without `curve`.
#include <fmt/format.h>

#include "runtime/base/memory_budget.h"
#include "runtime/files/input_file.h"
#include "runtime/files/skipped_contents.h"
#include "runtime/files/text_statements.h"
#include "runtime/io/format.h"
#include "runtime/io/ordered_chunks.h"
#include "runtime/io/records.h"
#include "runtime/points/trail.h"

namespace rapid {
namespace {

void write_obj(OutputFile& file, const PointSet& given, const FrameInfo&)
{
    const PointLines lines = with_lines(given);
    const PointSet& points = lines.points;
    std::vector<bool> is_on_line(points.size());
    for (const std::uint32_t i : lines.vertices) is_on_line[i] = true;
    std::vector<std::size_t> begin = {0};  // start of each line among the vertices
    for (const std::uint32_t size : lines.sizes) begin.push_back(begin.back() + size);

    const std::string head = "# Rapid points, metres\n";
    file.append(head.data(), head.size());
    append_chunks(file, points.size(), [&](std::size_t first, std::size_t last) {
        std::string text;
        for (std::size_t i = first; i < last; ++i) {
            const Vec3f& P = points.P()[i];
            fmt::format_to(std::back_inserter(text), "v {} {} {}\n", P.x(), P.y(), P.z());
        }
        return text;
    });
    append_chunks(file, points.size(), [&](std::size_t first, std::size_t last) {
        std::string text;
        for (std::size_t i = first; i < last; ++i)
            if (!is_on_line[i]) text += fmt::format(" {}", i + 1);
        return text.empty() || lines.sizes.empty() ? std::string() : "p" + text + "\n";
    });
    append_chunks(file, lines.sizes.size(), [&](std::size_t first, std::size_t last) {
        std::string text;
        for (std::size_t line = first; line < last; ++line) {
            text += 'l';
            for (std::size_t k = begin[line]; k < begin[line + 1]; ++k)
                text += fmt::format(" {}", lines.vertices[k] + 1);
            text += '\n';
        }
        return text;
    });
}

// Throws Error if that many positions do not fit in memory. A line takes at least two bytes per position. A growing
// list briefly takes three times its size, before the columns are created.
void check_memory(std::size_t positions)
{
    constexpr double bytes_per_position = 3 * (sizeof(Vec3f) + sizeof(std::int32_t)) + sizeof(std::int64_t);
    if (const double bytes = bytes_per_position * static_cast<double>(positions); !fits_in_memory(bytes))
        throw memory_exceeded(fmt::format("lines of at least {} positions", positions), bytes, "split the file");
}

// Returns true if the file has only comments, as an .obj file of no points has.
bool has_only_comments(std::string_view text) { return !text.empty() && !TextStatements(text).next(); }

PointSet read_obj(const std::filesystem::path& path)
{
    const InputFile file(path);
    const std::string_view text = file.text();
    std::vector<Vec3f> vertices, positions;
    std::vector<std::int32_t> curves;
    std::vector<std::size_t> alone;  // points on no line
    std::int32_t curve = 0;
    TextStatements statements(text);
    // Returns the vertex of an element. The part after a slash is its texture.
    const auto vertex_of = [&](std::string_view word) {
        const std::int64_t index = statements.index(word.substr(0, word.find('/')), vertices.size());
        if (index >= static_cast<std::int64_t>(vertices.size()))
            throw Error(
                fmt::format("line {}: there is no vertex {} of {}", statements.line(), index + 1, vertices.size()));
        return static_cast<std::size_t>(index);
    };
    while (statements.next()) {
        if (statements.keyword() == "v") {
            const Vec3f P = statements.vector();
            if (!P.allFinite()) throw Error(fmt::format("line {}: a position must be finite", statements.line()));
            vertices.push_back(P);
        } else if (statements.keyword() == "l") {
            for (std::string_view word = statements.word(); !word.empty(); word = statements.word()) {
                if (positions.size() == positions.capacity()) check_memory(positions.size());
                positions.push_back(vertices[vertex_of(word)]);
                curves.push_back(curve);
            }
            ++curve;
        } else if (statements.keyword() == "p") {
            for (std::string_view word = statements.word(); !word.empty(); word = statements.word())
                alone.push_back(vertex_of(word));
        }
    }
    if (vertices.empty() && !has_only_comments(text)) throw Error("is not an .obj file with vertices");
    if (!text.empty() && !text.ends_with('\n') && !text.ends_with('\r')) SkippedContents::note(no_last_newline);
    const bool has_lines = curve > 0;
    if (!has_lines) positions = vertices;
    for (const std::size_t vertex : alone)
        if (has_lines) positions.push_back(vertices[vertex]), curves.push_back(-1);

    PointSet points;
    points.append(positions.size());
    points.P() = Column<Vec3f>(std::span<const Vec3f>(positions));
    number_points(points);
    if (has_lines) points.set(curve_attribute, Column<std::int32_t>(std::span<const std::int32_t>(curves)));
    return points;
}

RAPID_FORMAT(Format{.extension = ".obj",
                    .doc = "Wavefront lines: only positions, with trails as polylines",
                    .write = write_obj,
                    .read = read_obj,
                    .positions_only = true,
                    .lines_stand_alone = true});

}  // namespace
}  // namespace rapid

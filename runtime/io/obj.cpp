// .obj: Wavefront's text format, as lines.
//
//   v x y z       each point, followed by the positions of trails
//   p 1           a point on no line
//   l 1 7 8 ...   a line: a trail, from the point itself backwards, or a curve (points/point_lines.h)
//
// It stores only positions, without velocities, attributes and groups. From any .obj file, the vertices of its lines
// are read as points in line order, with the index of the line as the attribute `curve`, from 0. If there are no lines,
// all vertices are read.
#include <fmt/format.h>

#include <charconv>

#include "runtime/base/memory_budget.h"
#include "runtime/files/input_file.h"
#include "runtime/io/format.h"
#include "runtime/io/ordered_chunks.h"
#include "runtime/points/point_lines.h"

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
            if (!is_on_line[i]) text += fmt::format("p {}\n", i + 1);
        return text;
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

// The words of a line, one after the other.
class Words {
public:
    explicit Words(std::string_view line) : line_(line) {}

    std::string_view next()
    {
        const std::size_t begin = line_.find_first_not_of(" \t\r");
        if (begin == std::string_view::npos) return line_ = {};
        line_.remove_prefix(begin);
        const std::string_view word = line_.substr(0, line_.find_first_of(" \t\r"));
        line_.remove_prefix(word.size());
        return word;
    }

private:
    std::string_view line_;
};

// Throws Error if that many positions do not fit in memory. A line takes at least two bytes per position. A growing
// list briefly takes three times its size, before the columns are created.
void check_memory(std::size_t positions)
{
    constexpr double bytes_per_position = 3 * (sizeof(Vec3f) + sizeof(std::int32_t)) + sizeof(std::int64_t);
    if (const double bytes = bytes_per_position * static_cast<double>(positions); !fits_in_memory(bytes))
        throw memory_exceeded(fmt::format("lines of at least {} positions", positions), bytes, "split the file");
}

// Parses a complete word. Throws Error if it is not a number.
template <class T>
T number_of(std::string_view word, std::size_t line)
{
    T number{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error != std::errc() || end != word.data() + word.size())
        throw Error(fmt::format("line {}: \"{}\" is not a number", line, word.substr(0, 40)));
    return number;
}

// Returns the vertex that an element of a line refers to: from 1, or backwards from the last one if negative. The part
// after a slash is its texture.
std::size_t vertex_of(std::string_view word, std::size_t vertices, std::size_t line)
{
    const auto index = number_of<std::int64_t>(word.substr(0, word.find('/')), line);
    const auto count = static_cast<std::int64_t>(vertices);
    const std::int64_t place = index < 0 ? count + index : index - 1;
    if (place < 0 || place >= count)
        throw Error(fmt::format("line {}: there is no vertex {} of {}", line, index, vertices));
    return static_cast<std::size_t>(place);
}

PointSet read_obj(const std::filesystem::path& path)
{
    const InputFile file(path);
    std::string_view text = file.text();
    const bool ends = text.ends_with('\n');
    std::vector<Vec3f> vertices, positions;
    std::vector<std::int32_t> curves;
    std::int32_t curve = 0;
    for (std::size_t number = 1; !text.empty(); ++number) {
        const std::string_view line = text.substr(0, text.find('\n'));
        text.remove_prefix(std::min(text.size(), line.size() + 1));
        Words words(line);
        const std::string_view kind = words.next();
        if (text.empty() && !ends && !kind.empty() && !kind.starts_with('#'))
            throw Error(
                fmt::format("line {}: there is no newline at the end, so the last number may be cut off; if the file "
                            "is complete, append a newline (echo >> FILE)",
                            number));
        if (kind == "v") {
            Vec3f P;
            for (int axis = 0; axis < 3; ++axis) P[axis] = number_of<float>(words.next(), number);
            if (!P.allFinite()) throw Error(fmt::format("line {}: a position must be finite", number));
            vertices.push_back(P);
        } else if (kind == "l") {
            for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
                if (positions.size() == positions.capacity()) check_memory(positions.size());
                positions.push_back(vertices[vertex_of(word, vertices.size(), number)]);
                curves.push_back(curve);
            }
            ++curve;
        }
    }
    if (vertices.empty()) throw Error("is not an .obj file with vertices");
    if (curve == 0) positions = vertices, curves.assign(vertices.size(), 0);

    PointSet points;
    points.append(positions.size());
    points.P() = Column<Vec3f>(std::span<const Vec3f>(positions));
    const std::span<std::int64_t> id = points.id().overwrite();
    for (std::size_t i = 0; i < id.size(); ++i) id[i] = static_cast<std::int64_t>(i);
    points.set(curve_attribute, Column<std::int32_t>(std::span<const std::int32_t>(curves)));
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

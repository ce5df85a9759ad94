// Reads meshes from STL files, binary or text. STL has face normals only, which are ignored. The name of a solid is a
// group of its faces. Colours of binary files become Cd of the faces.
#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "runtime/base/error.h"
#include "runtime/files/input_file.h"
#include "runtime/files/scalars.h"
#include "runtime/files/skipped_contents.h"
#include "runtime/files/text_statements.h"
#include "runtime/shapes/mesh/mesh_file.h"
#include "runtime/shapes/mesh/polygon.h"

namespace rapid {
namespace {

constexpr std::size_t title_bytes = 80, head_bytes = 84, facet_bytes = 50;

std::string lower_letters(std::string_view word)
{
    std::string text(word);
    std::transform(text.begin(), text.end(), text.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
    return text;
}

// Returns the number of facets of a binary file, or nothing if the file is text. The title of a binary file may begin
// like a text file, and bytes may follow its facets.
std::optional<std::size_t> facets_of_binary(std::string_view text)
{
    constexpr std::string_view space_or_mark = " \t\r\n\xef\xbb\xbf";
    const std::size_t begin = std::min(text.find_first_not_of(space_or_mark), text.size());
    const bool solid = lower_letters(text.substr(begin, 5)) == "solid";
    if (text.size() < head_bytes) return std::nullopt;
    const std::size_t facets = load_scalar<std::uint32_t>(
        reinterpret_cast<const unsigned char*>(text.data()) + title_bytes, ByteOrder::Little);
    const bool exact = text.size() == head_bytes + facet_bytes * facets;
    if (exact || !solid || text.substr(0, 512).find('\0') != std::string_view::npos) return facets;
    return std::nullopt;
}

// The colour of a facet has five bits per channel. Its highest bit is set if the facet has one (VisCAM), or clear if it
// does and the title contains "COLOR=" and the default colour of the others (Materialise, which swaps red and blue).
class FacetColours {
public:
    explicit FacetColours(std::string_view title)
    {
        constexpr std::string_view mark = "COLOR=";
        const std::size_t at = title.find(mark);
        if (at == std::string_view::npos || at + mark.size() + 3 > title.size()) return;
        materialise_ = true;
        for (int c = 0; c < 3; ++c)
            other_[c] = static_cast<float>(static_cast<unsigned char>(title[at + mark.size() + c])) / 255.0f;
    }

    void add(std::uint16_t bits)
    {
        constexpr float most = 31;
        const bool has_colour = (bits >> 15 == 0) == materialise_;
        coloured_ |= has_colour;
        Vec3f colour;
        for (int c = 0; c < 3; ++c) colour[materialise_ ? c : 2 - c] = static_cast<float>(bits >> 5 * c & 31) / most;
        colours_.push_back(has_colour ? colour : other_);
    }

    bool any() const { return coloured_ || materialise_; }
    std::vector<Vec3f>& all() { return colours_; }

private:
    bool materialise_ = false, coloured_ = false;
    Vec3f other_ = Vec3f::Constant(0.6f);
    std::vector<Vec3f> colours_;
};

MeshFile read_binary(std::string_view text, std::size_t facets)
{
    const std::size_t held = (text.size() - head_bytes) / facet_bytes;
    if (facets > held)
        throw Error(
            fmt::format("the file ends early: its header announces {} facets, but it contains {}", facets, held));
    MeshFile mesh;
    mesh.positions.reserve(3 * facets);
    mesh.triangles.reserve(facets);
    FacetColours colours(text.substr(0, title_bytes));
    for (std::size_t f = 0; f < facets; ++f) {
        constexpr std::size_t normal = 12, corner = 12, colour = 48;
        const auto* facet = reinterpret_cast<const unsigned char*>(text.data()) + head_bytes + facet_bytes * f;
        const auto first = static_cast<std::int32_t>(mesh.positions.size());
        for (std::size_t k = 0; k < 3; ++k) {
            Vec3f P;
            for (std::size_t axis = 0; axis < 3; ++axis)
                P[axis] = load_scalar<float>(facet + normal + corner * k + sizeof(float) * axis, ByteOrder::Little);
            mesh.positions.push_back(P);
        }
        mesh.triangles.emplace_back(first, first + 1, first + 2);
        colours.add(load_scalar<std::uint16_t>(facet + colour, ByteOrder::Little));
    }
    if (colours.any()) mesh.face_values.emplace("Cd", std::move(colours.all()));
    if (const std::size_t left = text.size() - head_bytes - facet_bytes * facets; left > 0)
        add_skipped(mesh.skipped, fmt::format("the {} bytes after its {} facets", left, facets));
    return mesh;
}

class StlText {
public:
    explicit StlText(std::string_view text) : lines_(text) {}

    MeshFile read()
    {
        bool ended = false;
        std::size_t solid = groups_.add_names({});
        while (lines_.next()) {
            const std::string keyword = lower_letters(lines_.keyword());
            if (keyword == "vertex") {
                corners_.push_back(static_cast<std::int32_t>(mesh_.positions.size()));
                mesh_.positions.push_back(lines_.vector());
            } else if (keyword == "endloop" || keyword == "endfacet") {
                end_loop(solid);
            } else if (keyword == "solid") {
                solid = groups_.add_names({std::string(lines_.rest_of_line())});
            }
            ended = keyword == "endsolid";
        }
        if (!ended) throw Error("the file ends early: its last line is not \"endsolid\"");
        groups_.add_to(mesh_);
        return std::move(mesh_);
    }

private:
    void end_loop(std::size_t solid)
    {
        if (corners_.empty()) return;
        if (corners_.size() < 3 || !cutter_.append(mesh_.positions, corners_, mesh_.triangles))
            throw Error(fmt::format("line {}: a facet ends after {} vertices; it must have three", lines_.line(),
                                    corners_.size()));
        corners_.clear();
        groups_.append(mesh_.triangles.size(), solid);
    }

    TextStatements lines_;
    MeshFile mesh_;
    GroupsOfFaces groups_;
    std::vector<std::int32_t> corners_;
    PolygonCutter cutter_;
};

}  // namespace

MeshFile read_stl_mesh(const std::filesystem::path& path)
{
    const InputFile input(path);
    const auto bytes = input.bytes();
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (const std::optional<std::size_t> facets = facets_of_binary(text)) return read_binary(text, *facets);
    const std::string_view without_mark = input.text();
    const std::size_t begin = std::min(without_mark.find_first_not_of(" \t\r\n"), without_mark.size());
    if (lower_letters(without_mark.substr(begin, 5)) != "solid")
        throw Error("not an STL file: it is too short for a binary one, and does not begin with \"solid\"");
    return StlText(without_mark).read();
}

}  // namespace rapid

// Reads meshes from OBJ files. A vertex may have a colour after its position (x y z red green blue): Cd. Texture
// coordinates become uv and normals N. Faces are in groups named after their object, groups and material. Material
// files are not read, and points, lines, curves and surfaces are ignored.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <set>

#include "runtime/base/error.h"
#include "runtime/base/memory_budget.h"
#include "runtime/files/input_file.h"
#include "runtime/files/skipped_contents.h"
#include "runtime/files/text_statements.h"
#include "runtime/shapes/mesh/mesh_file.h"
#include "runtime/shapes/mesh/polygon.h"

namespace rapid {
namespace {

class ObjReader {
public:
    explicit ObjReader(std::string_view text) : file_(text) {}

    MeshFile read()
    {
        while (file_.next()) read_statement();
        for (const Face& face : faces_) append(face);
        for (auto& [name, values] : mesh_.values)  // the last corners may have none
            std::get<std::vector<Vec3f>>(values).resize(mesh_.positions.size(), Vec3f::Zero());
        mesh_.alphas.assign(mesh_.colours.size(), 1.0f);
        groups_of_faces_.add_to(mesh_);
        return std::move(mesh_);
    }

private:
    using Corner = std::array<std::int32_t, 3>;  // indices of its position, texture coordinates and normal, or none
    static constexpr std::int32_t none = -1, most = std::numeric_limits<std::int32_t>::max();

    struct Face {
        std::size_t first, last;  // in corners_
        std::size_t line;
        std::size_t names;  // in groups_of_faces_
    };

    void read_statement()
    {
        const std::string_view keyword = file_.keyword();
        if (keyword == "v")
            read_vertex();
        else if (keyword == "vt")
            coordinates_.push_back(read_coordinates());
        else if (keyword == "vn")
            normals_.push_back(file_.vector());
        else if (keyword == "f" || keyword == "fo")
            read_face();
        else if (keyword == "o")
            object_ = {std::string(file_.rest_of_line())}, named_ = false;
        else if (keyword == "usemtl")
            material_ = {std::string(file_.rest_of_line())}, named_ = false;
        else if (keyword == "g")
            read_groups();
        else if (keyword == "curv" || keyword == "surf")
            add_skipped(mesh_.skipped, "its curves and surfaces");
    }

    void read_vertex()
    {
        positions_.push_back(file_.vector());
        std::vector<float> further;
        for (TextStatements rest = file_; !rest.word().empty();) further.push_back(file_.number());
        if (further.size() < 3) return;  // one number is the weight of a rational curve
        colours_.resize(positions_.size() - 1, Vec3f::Ones());
        colours_.emplace_back(further[0], further[1], further[2]);
    }

    Vec3f read_coordinates()
    {
        Vec3f uv(file_.number(), 0, 0);
        for (int axis = 1; axis < 3; ++axis)
            if (TextStatements rest = file_; !rest.word().empty()) uv[axis] = file_.number();
        return uv;
    }

    // A name may contain blanks, and a statement may name several groups: both readings are groups.
    void read_groups()
    {
        groups_ = {std::string(file_.rest_of_line())};
        for (std::string_view word = file_.word(); !word.empty(); word = file_.word()) groups_.emplace(word);
        named_ = false;
    }

    void read_face()
    {
        if (!named_) {
            std::set<std::string> names = groups_;
            names.insert(object_.begin(), object_.end());
            names.insert(material_.begin(), material_.end());
            names_ = groups_of_faces_.add_names(std::move(names));
            named_ = true;
        }
        const std::size_t first = corners_.size();
        for (std::string_view word = file_.word(); !word.empty(); word = file_.word()) {
            if (corners_.size() == corners_.capacity()) check_memory();
            corners_.push_back(read_corner(word));
        }
        // A face with one or two corners is a point or a line and has no surface.
        if (corners_.size() - first >= 3)
            faces_.push_back({first, corners_.size(), file_.line(), names_});
        else
            corners_.resize(first);
    }

    // Reads V, V/T, V//N or V/T/N.
    Corner read_corner(std::string_view word) const
    {
        constexpr std::string_view names[] = {"vertex", "uv", "normal"};
        const std::size_t counts[] = {positions_.size(), coordinates_.size(), normals_.size()};
        Corner corner{none, none, none};
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t slash = std::min(word.find('/'), word.size());
            if (slash > 0 || k == 0)
                corner[k] = static_cast<std::int32_t>(
                    std::min<std::int64_t>(most, file_.index(word.substr(0, slash), counts[k], names[k])));
            if (slash == word.size()) break;
            word.remove_prefix(slash + 1);
        }
        return corner;
    }

    // A corner takes two bytes or more of the file. A growing list briefly takes three times its size, and the mesh has
    // a position, normal, texture coordinates and a third of a triangle for each corner.
    void check_memory() const
    {
        constexpr double bytes_a_corner = 3 * sizeof(Corner) + 4 * sizeof(Vec3f);
        const double bytes = bytes_a_corner * static_cast<double>(corners_.size());
        if (!fits_in_memory(bytes))
            throw memory_exceeded(fmt::format("faces of at least {} corners", corners_.size()), bytes,
                                  "split the file");
    }

    // Appends an attribute of corners. Corners without one, or with one that the file lacks, get 0.
    void append_value(const std::string& name, const std::vector<Vec3f>& values, std::int32_t index)
    {
        if (values.empty() && index == none) return;
        auto& list = std::get<std::vector<Vec3f>>(mesh_.values.try_emplace(name, std::vector<Vec3f>()).first->second);
        list.resize(mesh_.positions.size() - 1, Vec3f::Zero());
        const bool is_there = index != none && static_cast<std::size_t>(index) < values.size();
        list.push_back(is_there ? values[static_cast<std::size_t>(index)] : Vec3f(Vec3f::Zero()));
        if (index != none && !is_there)
            add_note(mesh_.skipped, fmt::format("faces have a {} that the file lacks; it is taken as 0", name));
    }

    void append(const Face& face)
    {
        polygon_.clear();
        for (std::size_t c = face.first; c < face.last; ++c) {
            const auto [position, coordinates, normal] = corners_[c];
            polygon_.push_back(static_cast<std::int32_t>(mesh_.positions.size()));
            if (static_cast<std::size_t>(position) >= positions_.size())
                throw Error(fmt::format("line {}: a face has the vertex {}; there are {}, from 1", face.line,
                                        std::int64_t{position} + 1, positions_.size()));
            mesh_.positions.push_back(positions_[static_cast<std::size_t>(position)]);
            if (!colours_.empty())
                mesh_.colours.push_back(static_cast<std::size_t>(position) < colours_.size()
                                            ? colours_[static_cast<std::size_t>(position)]
                                            : Vec3f(Vec3f::Ones()));
            append_value("uv", coordinates_, coordinates);
            append_value("N", normals_, normal);
        }
        if (!cutter_.append(mesh_.positions, polygon_, mesh_.triangles))
            throw Error(
                fmt::format("line {}: a face has {} corners in a line too winding to be cut into triangles; divide "
                            "it",
                            face.line, polygon_.size()));
        groups_of_faces_.append(mesh_.triangles.size(), face.names);
    }

    TextStatements file_;
    MeshFile mesh_;
    std::vector<Vec3f> positions_, colours_, coordinates_, normals_;
    std::vector<Corner> corners_;
    std::vector<Face> faces_;
    std::set<std::string> object_, material_, groups_;
    GroupsOfFaces groups_of_faces_;
    std::size_t names_ = 0;
    bool named_ = false;  // names_ are the current names
    std::vector<std::int32_t> polygon_;
    PolygonCutter cutter_;
};

}  // namespace

MeshFile read_obj_mesh(const std::filesystem::path& path)
{
    const InputFile input(path);
    MeshFile mesh = ObjReader(input.text()).read();
    if (const auto normals = mesh.values.find("N"); normals != mesh.values.end())
        for (Vec3f& N : std::get<std::vector<Vec3f>>(normals->second)) N.stableNormalize();
    return mesh;
}

}  // namespace rapid

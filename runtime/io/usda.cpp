// .usda: USD's text format, with a Points prim "points" that has a sample of each attribute at the frame's time code,
// as usdview, Houdini and Blender read it. Value clips join the files of a sequence.
//
//   point3f[] points.timeSamples = { 12: [(x, y, z), ...], }
//
// P is points, v is velocities, id is ids, pscale is half of widths, N is normals, Cd is primvars:displayColor, Alpha
// is primvars:displayOpacity. Any other attribute is primvars:NAME, and a group is bool[] primvars:group_NAME. Floats
// have 9 significant digits, which identify the float. For reading see usda_points.h.
#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstring>
#include <map>

#include "runtime/files/input_file.h"
#include "runtime/files/left_out.h"
#include "runtime/io/attribute_names.h"
#include "runtime/io/format.h"
#include "runtime/io/ordered_chunks.h"
#include "runtime/io/records.h"
#include "runtime/io/usda_points.h"

namespace rapid {
namespace {

constexpr std::string_view primvar = "primvars:";

struct UsdName {
    std::string_view ours, theirs, type;
};
constexpr UsdName usd_names[] = {{"P", "points", "point3f"},
                                 {"v", "velocities", "vector3f"},
                                 {"id", "ids", "int64"},
                                 {"pscale", "widths", "float"},
                                 {"N", "normals", "normal3f"},
                                 {"Cd", "primvars:displayColor", "color3f"},
                                 {"Alpha", "primvars:displayOpacity", "float"}};

std::string_view usd_type(AttributeType type)
{
    static constexpr std::string_view names[] = {"float", "float3", "int", "int64", "quatf", "string"};
    static_assert(std::size(names) == std::variant_size_v<AnyColumn>);
    return names[static_cast<std::size_t>(type)];
}

// Returns USD's name and type of an attribute. If its type differs from that of USD's attribute of this name, it is a
// primvar.
UsdName usd_name(const std::string& name, AttributeType type, std::string& storage)
{
    const bool vec3 = type == AttributeType::Vec3;
    for (const UsdName& known : usd_names) {
        if (known.ours != name) continue;
        if (known.type == usd_type(type) || (vec3 && known.type.ends_with("3f"))) return known;
    }
    storage = std::string(primvar) + name;
    return {name, storage, usd_type(type)};
}

// Throws Error if the name is not a USD identifier.
void check_identifier(std::string_view name)
{
    const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
    const bool good = !name.empty() && is_letter(name[0]) && std::all_of(name.begin(), name.end(), [&](char c) {
        return is_letter(c) || (c >= '0' && c <= '9');
    });
    if (!good)
        throw Error(
            fmt::format("the name \"{}\" can't be written to .usda; it must be of letters, digits and _, and "
                        "begin with no digit; rename the attribute or group",
                        name));
}

void put(std::string& text, float value)
{
    char number[24];
    if (std::isnan(value))
        text += "nan";
    else
        text.append(number, std::to_chars(number, std::end(number), value, std::chars_format::general, 9).ptr);
}
template <class Integer>
void put_integer(std::string& text, Integer value)
{
    char number[24];
    text.append(number, std::to_chars(number, std::end(number), value).ptr);
}
void put(std::string& text, std::int32_t value) { put_integer(text, value); }
void put(std::string& text, std::int64_t value) { put_integer(text, value); }
void put(std::string& text, std::uint8_t value) { text += value ? '1' : '0'; }
void put_tuple(std::string& text, std::initializer_list<float> numbers)
{
    char before = '(';
    for (const float number : numbers) {
        text += before;
        if (before == ',') text += ' ';
        put(text, number);
        before = ',';
    }
    text += ')';
}
void put(std::string& text, const Vec3f& value) { put_tuple(text, {value.x(), value.y(), value.z()}); }
// Writes the real part first.
void put(std::string& text, const Quatf& value) { put_tuple(text, {value.w(), value.x(), value.y(), value.z()}); }

void put(std::string& text, Token value)
{
    text += '"';
    for (const char c : value.text()) {
        if (c == '"' || c == '\\')
            text += {'\\', c};
        else if (c == '\n')
            text += "\\n";
        else if (static_cast<unsigned char>(c) < ' ')
            text += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
        else
            text += c;
    }
    text += '"';
}

class UsdaWriter {
public:
    UsdaWriter(OutputFile& file, const PointSet& points, const FrameInfo& frame)
        : file_(file), points_(points), frame_(frame)
    {
    }

    void write()
    {
        check_names();
        append(
            fmt::format("#usda 1.0\n(\n    defaultPrim = \"points\"\n    doc = \"Rapid points\"\n"
                        "    endTimeCode = {0}\n    framesPerSecond = {1}\n    metersPerUnit = 1\n"
                        "    startTimeCode = {0}\n    timeCodesPerSecond = {1}\n    upAxis = \"Y\"\n)\n\n"
                        "def Points \"points\"\n{{\n",
                        frame_.number, frame_.fps));
        write_extent();
        std::vector<std::string> attributes = further_attributes(points_);
        attributes.insert(attributes.begin(), {"P", "v", "id"});
        for (const std::string& name : attributes)
            std::visit([&](const auto& column) { write_attribute(name, column); }, *points_.find(name));
        for (const auto& [name, members] : points_.groups())
            write_array("bool", std::string(primvar) + std::string(group_prefix) + name, members,
                        [](std::uint8_t member) { return member; });
        append("}\n");
    }

private:
    void append(const std::string& text) { file_.append(text.data(), text.size()); }

    void check_names() const
    {
        std::vector<std::string> names;
        std::string storage;
        for (const auto& [name, column] : points_.columns()) {
            check_identifier(name);
            names.emplace_back(usd_name(name, type_of(column), storage).theirs);
        }
        for (const std::string& name : points_.group_names()) {
            check_identifier(name);
            names.push_back(std::string(primvar) + std::string(group_prefix) + name);
        }
        check_column_names(names, "");
    }

    // Writes the bounding box, which viewers use for framing and culling.
    void write_extent()
    {
        if (points_.empty()) return;
        const Column<float>* radii = points_.find<float>("pscale");
        Box3f box;
        for (std::size_t i = 0; i < points_.size(); ++i) {
            const Vec3f radius = Vec3f::Constant(radii ? (*radii)[i] : 0);
            box.extend(Vec3f(points_.P()[i] - radius));
            box.extend(Vec3f(points_.P()[i] + radius));
        }
        std::string corners;
        put(corners, Vec3f(box.min()));
        corners += ", ";
        put(corners, Vec3f(box.max()));
        append(
            fmt::format("    float3[] extent.timeSamples = {{\n        {}: [{}],\n    }}\n", frame_.number, corners));
    }

    template <class T>
    void write_attribute(const std::string& name, const Column<T>& column)
    {
        std::string storage;
        const UsdName known = usd_name(name, type_of(AnyColumn(column)), storage);
        if constexpr (std::is_same_v<T, float>) {
            // USD's widths are diameters.
            if (known.theirs == "widths") return write_array("float", "widths", column, [](float r) { return 2 * r; });
        }
        write_array(known.type, known.theirs, column, [](const T& value) { return value; });
    }

    template <class T, class F>
    void write_array(std::string_view type, std::string_view name, const Column<T>& column, const F& stored)
    {
        // A primvar is constant unless it states otherwise. Uniform values are written for each point too, because
        // joined frames must have the same interpolation.
        if (name.starts_with(primvar))
            append(fmt::format("    {}[] {} (\n        interpolation = \"vertex\"\n    )\n", type, name));
        append(fmt::format("    {}[] {}.timeSamples = {{\n        {}: [", type, name, frame_.number));
        append_chunks(file_, points_.size(), [&](std::size_t begin, std::size_t end) {
            std::string text;
            for (std::size_t i = begin; i < end; ++i) {
                if (i > 0) text += ", ";
                put(text, stored(column[i]));
            }
            return text;
        });
        append("],\n    }\n");
    }

    OutputFile& file_;
    const PointSet& points_;
    const FrameInfo& frame_;
};

void write_usda(OutputFile& file, const PointSet& points, const FrameInfo& frame)
{
    UsdaWriter(file, points, frame).write();
}

std::string attribute_of_property(std::string_view name)
{
    for (const UsdName& known : usd_names)
        if (name == known.theirs) return std::string(known.ours);
    return std::string(name.starts_with(primvar) ? name.substr(primvar.size()) : name);
}

// Returns one string for all points, or one per point.
Column<Token> texts_of(const UsdArray& array, std::size_t size)
{
    std::vector<Token> texts(array.rows());
    if (!texts.empty()) std::memcpy(static_cast<void*>(texts.data()), array.bytes.data(), array.bytes.size());
    if (texts.size() != size) return Column<Token>(size, texts[0], Token());
    return Column<Token>(std::span<const Token>(texts));
}

PointSet read_usda(const std::filesystem::path& path)
{
    const InputFile file(path);
    const std::vector<UsdArray> arrays = usda_points(file.text());
    const auto place = std::find_if(arrays.begin(), arrays.end(), [](const UsdArray& a) { return a.name == "points"; });
    if (place == arrays.end() || place->tuple != 3) throw Error("the prim of points has no points of three numbers");

    PointSet points;
    points.append(place->rows());
    bool has_id = false;
    std::vector<std::string> names;
    for (const UsdArray& array : arrays) {
        const bool constant = array.rows() == 1;
        if (array.name == "extent") continue;  // not a value per point
        if (array.rows() != points.size() && !constant) {
            LeftOut::add(fmt::format("{} of {} values; there are {} points", array.name, array.rows(), points.size()));
            continue;
        }
        if (array.texts) {
            points.set(attribute_of_property(array.name), texts_of(array, points.size()));
            names.push_back(array.name);
            continue;
        }
        RecordAttribute attribute;
        attribute.name = attribute_of_property(array.name);
        attribute.type = array.type;
        attribute.group =
            array.type == ScalarType::UInt8 && array.tuple == 1 && attribute.name.starts_with(group_prefix);
        if (attribute.group) attribute.name.erase(0, group_prefix.size());
        if (array.name == "widths") attribute.scale = 0.5;
        const std::size_t number = scalar_bytes(attribute.type);
        for (std::size_t c = 0; c < array.tuple; ++c) attribute.offsets.push_back(c * number);
        // Rapid's quaternions have the real part last.
        if (array.quaternion)
            std::rotate(attribute.offsets.begin(), attribute.offsets.begin() + 1, attribute.offsets.end());
        const std::size_t stride = constant ? 0 : array.tuple * number;
        read_attribute(points, {array.bytes, points.size(), stride, ByteOrder::Little}, attribute);
        has_id |= attribute.name == "id" && array.tuple == 1 && !attribute.group;
        names.push_back(array.name);
    }
    check_column_names(names, "");
    if (!has_id) number_points(points);
    return points;
}

RAPID_FORMAT(Format{".usda", "USD's text, points at the frame's time code; all types", write_usda, read_usda});

}  // namespace
}  // namespace rapid

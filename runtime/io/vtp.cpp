// .vtp: VTK's PolyData in XML ("VTK File Formats"), as ParaView and VTK read it. The arrays are appended to the XML in
// binary, each after a byte count:
//
//   <VTKFile type="PolyData" ...> ... <DataArray type="Float32" Name="v" ... offset="0"/> ...
//   <AppendedData encoding="raw">_ | for each array: uint64 bytes, its numbers | </AppendedData></VTKFile>
//
// P is the Points, a string attribute is an Array of type String (its bytes: each string and a zero byte), any other
// attribute is an array of the PointData, and a group is UInt8 group_NAME. One cell with all points makes them visible.
// The field TimeValue is the time of the frame, s. For reading see vtk_arrays.h.
#include <fmt/format.h>

#include <numeric>
#include <pugixml.hpp>
#include <sstream>

#include "runtime/files/input_file.h"
#include "runtime/files/left_out.h"
#include "runtime/io/attribute_names.h"
#include "runtime/io/format.h"
#include "runtime/io/records.h"
#include "runtime/io/vtk_arrays.h"

namespace rapid {
namespace {

std::string_view vtk_type(AttributeType type)
{
    if (type == AttributeType::String) return "String";
    if (type == AttributeType::Int32) return "Int32";
    return type == AttributeType::Int64 ? "Int64" : "Float32";
}

// Returns the characters that XML cannot represent.
std::string control_characters()
{
    std::string text(' ', '\0');
    std::iota(text.begin(), text.end(), '\0');
    return text;
}

// The XML with a position for the data, and the arrays that belong there.
class VtpWriter {
public:
    explicit VtpWriter(const PointSet& points)
        : points_(points),
          connectivity_(AnyColumn(Column<std::int64_t>(points.size()))),
          offsets_(AnyColumn(Column<std::int64_t>(!points.empty(), static_cast<std::int64_t>(points.size()))))
    {
        const std::span<std::int64_t> places = std::get<Column<std::int64_t>>(connectivity_).write();
        std::iota(places.begin(), places.end(), std::int64_t{0});
    }

    void write(OutputFile& file, const FrameInfo& frame)
    {
        describe(frame);
        std::ostringstream text;
        document_.save(text, "  ");
        const std::string xml = text.str();
        const std::size_t place = xml.rfind("_</AppendedData>") + 1;
        file.append(xml.data(), place);
        std::uint64_t at = file.appended();
        for (const Array& array : arrays_) {
            const std::uint64_t bytes = array.bytes();
            file.write_at(at, &bytes, sizeof bytes);
            if (array.texts)
                write_texts(file, at + sizeof bytes, *array.texts);
            else
                array.records.write(file, at + sizeof bytes, array.size);
            at += sizeof bytes + bytes;
        }
        file.write_at(at, xml.data() + place, xml.size() - place);
    }

private:
    struct Array {
        RecordWriter records;
        std::size_t size;
        const Column<Token>* texts = nullptr;

        std::uint64_t bytes() const
        {
            if (!texts) return records.record_bytes() * size;
            std::uint64_t sum = size;  // a zero byte after each
            for (std::size_t i = 0; i < size; ++i) sum += (*texts)[i].text().size();
            return sum;
        }
    };

    static void write_texts(OutputFile& file, std::uint64_t at, const Column<Token>& texts)
    {
        std::string piece;
        for (std::size_t i = 0; i < texts.size(); ++i) {
            piece += texts[i].text();
            piece += '\0';
            if (i + 1 < texts.size() && piece.size() < (std::size_t{1} << 20)) continue;
            file.write_at(at, piece.data(), piece.size());
            at += piece.size();
            piece.clear();
        }
    }

    void describe(const FrameInfo& frame)
    {
        pugi::xml_node root = document_.append_child("VTKFile");
        root.append_attribute("type") = "PolyData";
        root.append_attribute("version") = "1.0";
        root.append_attribute("byte_order") = "LittleEndian";
        root.append_attribute("header_type") = "UInt64";
        pugi::xml_node data = root.append_child("PolyData");
        pugi::xml_node time = data.append_child("FieldData").append_child("DataArray");
        time.append_attribute("type") = "Float64";
        time.append_attribute("Name") = "TimeValue";
        time.append_attribute("NumberOfTuples") = 1;
        time.append_attribute("format") = "ascii";
        time.text() = fmt::format("{}", frame.time).c_str();

        pugi::xml_node piece = data.append_child("Piece");
        piece.append_attribute("NumberOfPoints") = static_cast<unsigned long long>(points_.size());
        piece.append_attribute("NumberOfVerts") = points_.empty() ? 0 : 1;
        for (const char* other : {"NumberOfLines", "NumberOfStrips", "NumberOfPolys"})
            piece.append_attribute(other) = 0;
        describe_attributes(piece.append_child("PointData"));
        add(piece.append_child("Points"), "P", *points_.find("P"));
        pugi::xml_node verts = piece.append_child("Verts");
        add(verts, "connectivity", connectivity_);
        add(verts, "offsets", offsets_);
        pugi::xml_node appended = root.append_child("AppendedData");
        appended.append_attribute("encoding") = "raw";
        appended.text() = "_";
    }

    void describe_attributes(pugi::xml_node to)
    {
        to.append_attribute("Vectors") = "v";
        if (points_.find<Vec3f>("N")) to.append_attribute("Normals") = "N";
        std::vector<std::string> names = further_attributes(points_);
        names.insert(names.begin(), {"v", "id"});
        for (const std::string& name : names) add(to, name, *points_.find(name));
        for (const auto& [name, members] : points_.groups()) {
            names.push_back(std::string(group_prefix) + name);
            Array& array = add(to, names.back(), "UInt8", 1, points_.size());
            array.records.add_group(members);
        }
        check_column_names(names, control_characters());
    }

    void add(pugi::xml_node to, const std::string& name, const AnyColumn& column)
    {
        const std::size_t size = std::visit([](const auto& c) { return c.size(); }, column);
        const AttributeType type = type_of(column);
        Array& array = add(to, name, vtk_type(type), component_count(type), size);
        if ((array.texts = std::get_if<Column<Token>>(&column)) == nullptr) array.records.add(name, column);
    }

    Array& add(pugi::xml_node to, const std::string& name, std::string_view type, std::size_t numbers, std::size_t size)
    {
        if (!arrays_.empty()) {
            const Array& before = arrays_.back();
            offset_ += sizeof(std::uint64_t) + before.bytes();
        }
        pugi::xml_node array = to.append_child(type == "String" ? "Array" : "DataArray");
        array.append_attribute("type") = std::string(type).c_str();
        array.append_attribute("Name") = name.c_str();
        array.append_attribute("NumberOfComponents") = static_cast<unsigned>(numbers);
        if (type == "String") array.append_attribute("NumberOfTuples") = static_cast<unsigned long long>(size);
        array.append_attribute("format") = "appended";
        array.append_attribute("offset") = static_cast<unsigned long long>(offset_);
        return arrays_.emplace_back(Array{RecordWriter(ByteOrder::Little, RecordWriter::Wide), size});
    }

    const PointSet& points_;
    AnyColumn connectivity_, offsets_;  // of the cell
    pugi::xml_document document_;
    std::vector<Array> arrays_;
    std::uint64_t offset_ = 0;  // of the last array, relative to the first one
};

void write_vtp(OutputFile& file, const PointSet& points, const FrameInfo& frame)
{
    VtpWriter(points).write(file, frame);
}

RecordAttribute attribute_of(const std::string& name, const VtkArray& array)
{
    RecordAttribute attribute;
    attribute.type = array.type;
    attribute.group = array.type == ScalarType::UInt8 && array.numbers == 1 && name.starts_with(group_prefix);
    attribute.name = attribute.group ? name.substr(group_prefix.size()) : name;
    for (std::size_t c = 0; c < array.numbers; ++c) attribute.offsets.push_back(c * scalar_bytes(array.type));
    return attribute;
}

Column<Token> text_column(const std::vector<Token>& texts) { return Column<Token>(std::span<const Token>(texts)); }

pugi::xml_node only_piece(const pugi::xml_document& document)
{
    pugi::xml_node piece;
    for (const pugi::xml_node child : document.child("VTKFile").child("PolyData").children("Piece")) {
        if (piece) throw Error("the file has several pieces; it must have one");
        piece = child;
    }
    if (!piece) throw Error("the file has no piece");
    return piece;
}

PointSet read_vtp(const std::filesystem::path& path)
{
    const InputFile file(path);
    const VtkFile vtk(file.text(), "PolyData");
    const pugi::xml_node piece = only_piece(vtk.document());
    const std::optional<std::size_t> n = whole_number(piece.attribute("NumberOfPoints").value());
    if (!n) throw Error("its piece has no NumberOfPoints");

    PointSet points;
    bool has_id = false;
    const auto read = [&](const std::string& name, const VtkArray& array) {
        const RecordAttribute attribute = attribute_of(name, array);
        const std::size_t stride = array.numbers * scalar_bytes(array.type);
        read_attribute(points, {array.bytes, *n, stride, array.order}, attribute);
        has_id |= attribute.name == "id" && !attribute.group && array.numbers == 1;
    };
    if (*n > 0) {
        const std::optional<VtkArray> P = vtk.array(piece.child("Points").child("DataArray"), *n);
        if (!P || P->numbers != 3 || !is_floating(P->type))
            throw Error("its Points are no array of three floats for each point");
        points.append(*n);
        read("P", *P);
    }
    std::vector<std::string> names = {"P"};
    for (const pugi::xml_node node : piece.child("PointData").children("DataArray")) {
        const std::optional<VtkArray> array = vtk.array(node, *n);
        if (!array) {
            LeftOut::add(fmt::format("the array \"{}\" of the type {}, {} numbers a point",
                                     node.attribute("Name").value(), node.attribute("type").value(),
                                     node.attribute("NumberOfComponents").as_string("1")));
            continue;
        }
        names.emplace_back(node.attribute("Name").value());
        read(names.back(), *array);
    }
    for (const pugi::xml_node node : piece.child("PointData").children("Array")) {
        const std::string name = node.attribute("Name").value();
        if (node.attribute("type").value() != std::string_view("String") ||
            node.attribute("NumberOfComponents").as_uint(1) != 1) {
            LeftOut::add(fmt::format("the array \"{}\" of the type {}", name, node.attribute("type").value()));
            continue;
        }
        names.push_back(name);
        points.set(name, text_column(vtk.texts(node, *n)));
    }
    for (const auto& [count, what] : {std::pair("NumberOfLines", "lines"), std::pair("NumberOfStrips", "strips"),
                                      std::pair("NumberOfPolys", "polygons")})
        if (const unsigned found = piece.attribute(count).as_uint(); found > 0)
            LeftOut::add(fmt::format("its {} {}", found, what));
    check_column_names(names, "");
    if (!has_id) number_points(points);
    return points;
}

RAPID_FORMAT(Format{".vtp", "VTK's points, for ParaView; all types", write_vtp, read_vtp});

}  // namespace
}  // namespace rapid

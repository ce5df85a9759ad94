// .bgeo: Houdini's classic binary geometry, version 5, as Houdini and Partio read it.
//
// Big-endian throughout:
//
//   "Bgeo" 'V' | int32: 5, points, primitives 0, point groups 0, primitive groups 0, point attributes, 0, 0, 0
//   for each attribute: int16 length, name, int16 size, int32 type (0 float, 1 int, 4 text, 5 vector), size defaults
//   for each point: float x y z 1, then the attributes
//   0x00 0xff: the (empty) extra section
//
// id and other int64 are int32; one that does not fit is refused. A group is an int attribute group_NAME, 0 or 1:
// Partio has no groups, and drops those of the format. Houdini turns one into a group with "Group Expression".
#include <fmt/format.h>

#include <bit>
#include <cstring>

#include "runtime/io/attribute_names.h"
#include "runtime/io/format.h"
#include "runtime/io/records.h"

namespace rapid {
namespace {

constexpr std::string_view group_prefix = "group_";

enum HoudiniType : std::int32_t { FloatType = 0, IntType = 1, TextType = 2, IndexType = 4, VectorType = 5 };

class BigEndianText {
public:
    void bytes(std::string_view text) { text_ += text; }
    void int16(std::size_t value) { integer(value, 2); }
    void int32(std::size_t value) { integer(value, 4); }
    void string(std::string_view text)
    {
        int16(text.size());
        bytes(text);
    }
    const std::string& text() const { return text_; }

private:
    void integer(std::size_t value, int size)
    {
        for (int shift = 8 * (size - 1); shift >= 0; shift -= 8) text_ += static_cast<char>(value >> shift & 0xff);
    }
    std::string text_;
};

HoudiniType houdini_type(const std::string& name, AttributeType type)
{
    switch (type) {
        case AttributeType::Int32:
        case AttributeType::Int64:
            return IntType;
        // Vectors turn with the geometry; colours do not.
        case AttributeType::Vec3:
            return name == "Cd" ? FloatType : VectorType;
        case AttributeType::Float:
        case AttributeType::Quat:
            break;
    }
    return FloatType;
}

// The words that a new point has in the attribute.
std::vector<std::uint32_t> default_words(const AnyColumn& column)
{
    return std::visit(
        [](const auto& c) {
            using T = std::decay_t<decltype(c[0])>;
            const T& fallback = c.fallback();
            if constexpr (std::is_same_v<T, std::int64_t>) {
                return std::vector<std::uint32_t>{static_cast<std::uint32_t>(fallback)};
            } else {
                std::vector<std::uint32_t> words(sizeof(T) / 4);
                std::memcpy(words.data(), &fallback, sizeof(T));
                return words;
            }
        },
        column);
}

void write_bgeo(const std::filesystem::path& path, const PointSet& points, const FrameInfo&)
{
    if (points.size() > 0x7fffffff)
        throw Error(fmt::format("{} points are more than .bgeo can count; write .vdb", points.size()));

    std::vector<std::string> names = further_attributes(points);
    names.insert(names.begin(), {"v", "id"});

    std::vector<std::string> unique = names;
    for (const auto& [name, members] : points.groups()) unique.push_back(std::string(group_prefix) + name);
    check_column_names(unique, std::string_view("\0", 1));

    BigEndianText header;
    header.bytes("BgeoV");
    for (const std::size_t count :
         {std::size_t{5}, points.size(), std::size_t{0}, std::size_t{0}, std::size_t{0},
          names.size() + points.groups().size(), std::size_t{0}, std::size_t{0}, std::size_t{0}})
        header.int32(count);

    RecordWriter records(ByteOrder::Big);
    records.add("P", *points.find("P"));
    records.add_constant(1.0f);
    for (const std::string& name : names) {
        const AnyColumn& column = *points.find(name);
        records.add(name, column);
        header.string(name);
        header.int16(component_count(type_of(column)));
        header.int32(houdini_type(name, type_of(column)));
        for (const std::uint32_t word : default_words(column)) header.int32(word);
    }
    for (const auto& [name, members] : points.groups()) {
        records.add_group(members, ScalarType::Int32);
        header.string(std::string(group_prefix) + name);
        header.int16(1);
        header.int32(IntType);
        header.int32(0);
    }

    OutputFile file(path);
    file.append(header.text().data(), header.text().size());
    records.write(file, file.appended(), points.size());
    const unsigned char extra[] = {0x00, 0xff};
    file.write_at(file.appended() + records.record_bytes() * points.size(), extra, sizeof extra);
    file.close();
}

class BigEndianReader {
public:
    explicit BigEndianReader(std::span<const unsigned char> bytes) : bytes_(bytes) {}

    std::string string(std::size_t size)
    {
        const std::span<const unsigned char> taken = take(size);
        return {taken.begin(), taken.end()};
    }
    std::uint32_t integer(std::size_t size)
    {
        std::uint32_t value = 0;
        for (const unsigned char byte : take(size)) value = value << 8 | byte;
        return value;
    }
    std::span<const unsigned char> rest() const { return bytes_; }
    std::span<const unsigned char> take(std::size_t size)
    {
        if (size > bytes_.size()) throw Error("the file ends within its header");
        const auto taken = bytes_.first(size);
        bytes_ = bytes_.subspan(size);
        return taken;
    }

private:
    std::span<const unsigned char> bytes_;
};

PointSet read_bgeo(const std::filesystem::path& path)
{
    const InputFile file(path);
    BigEndianReader reader(file.bytes());
    if (file.bytes().size() >= 4 && std::memcmp(file.bytes().data(), "\x7fNSJ", 4) == 0)
        throw Error("this is the newer bgeo, in JSON; Rapid reads the classic one (in Houdini: .bhclassic)");
    if (file.bytes().size() < 5 || reader.string(5) != "BgeoV") throw Error("not a classic bgeo file");
    const std::uint32_t version = reader.integer(4);
    if (version != 5) throw Error(fmt::format("bgeo version {} can't be read; it must be 5", version));
    const std::size_t n = reader.integer(4);
    reader.take(3 * 4);  // primitives and the groups, which come after the points
    const std::uint32_t count = reader.integer(4);
    reader.take(3 * 4);  // attributes of vertices, primitives and the whole

    std::size_t stride = 16;
    std::vector<RecordAttribute> attributes = {{"P", ScalarType::Float, {0, 4, 8}}};
    for (std::uint32_t a = 0; a < count; ++a) {
        const std::string name = reader.string(reader.integer(2));
        const std::size_t size = reader.integer(2);
        const std::uint32_t type = reader.integer(4);
        if (type == FloatType || type == IntType || type == VectorType) {
            reader.take(4 * size);
            RecordAttribute& attribute = attributes.emplace_back();
            attribute.name = name;
            attribute.type = type == IntType ? ScalarType::Int32 : ScalarType::Float;
            attribute.group = type == IntType && size == 1 && name.starts_with(group_prefix);
            if (attribute.group) attribute.name = name.substr(group_prefix.size());
            for (std::size_t c = 0; c < size; ++c) attribute.offsets.push_back(stride + 4 * c);
            stride += 4 * size;
        } else if (type == TextType) {
            reader.take(size);  // its default
            stride += size;
        } else if (type == IndexType) {
            for (std::uint32_t entries = reader.integer(4); entries > 0; --entries) reader.take(reader.integer(2));
            stride += 4 * size;
        } else {
            throw Error(fmt::format("attribute \"{}\" has the unknown type {}", name, type));
        }
    }
    if (n > reader.rest().size() / stride)
        throw Error(fmt::format("the file ends early: its header promises {} points, it holds {}", n,
                                reader.rest().size() / stride));
    return read_records(reader.rest(), n, stride, ByteOrder::Big, attributes);
}

RAPID_FORMAT(Format{".bgeo", "classic Houdini geometry, read by Houdini and Partio; id as int32", write_bgeo,
                    read_bgeo});

}  // namespace
}  // namespace rapid

// .bgeo: Houdini's classic binary geometry, version 5, as Houdini and Partio read it.
//
// Big-endian throughout:
//
//   "Bgeo" 'V' | int32: 5, points, lines, point groups, primitive groups 0, point attributes, 0, 0, 0
//   for each attribute: int16 length, name, int16 size, int32 type (0 float, 1 int, 5 vector), default values;
//       for strings type 4, int32 count, and for each string int16 length, text
//   for each point: float x y z 1, then the attributes; for a string its index, int32
//   for each line (points/trail.h): int32 1, vertices, ':', then the index of each (int16 below 65536 points)
//   for each group: int16 length, name, int32 points, and a bit per point in int32 words, lowest bit first
//   0x00 0xff: the (empty) extra section
//
// int64 (id) is written as int32, and refused if it does not fit. Partio reads no groups. Polygons are read, and open
// ones become lines. Other primitives and the groups after them are skipped, because only Houdini knows their size.
#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <map>

#include "runtime/files/input_file.h"
#include "runtime/files/skipped_contents.h"
#include "runtime/io/attribute_names.h"
#include "runtime/io/format.h"
#include "runtime/io/point_file.h"
#include "runtime/io/records.h"
#include "runtime/io/text_table.h"
#include "runtime/points/trail.h"

namespace rapid {
namespace {

// Marks an ordered group. It replaces the first byte of the length of the group's name.
constexpr unsigned char ordered_mark = 1;
constexpr std::size_t longest_group_name = 255;

constexpr std::size_t words_of(std::size_t bits) { return (bits + 31) / 32; }

constexpr std::size_t longest_text = 32767;

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
        // Vectors rotate with the geometry; colours do not.
        case AttributeType::Vec3:
            return name == "Cd" ? FloatType : VectorType;
        case AttributeType::String:
            return IndexType;
        case AttributeType::Float:
        case AttributeType::Quat:
            break;
    }
    return FloatType;
}

// Returns the default value of the attribute as words.
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

// Returns the section of all groups.
std::string group_section(const PointSet& points)
{
    BigEndianText section;
    for (const auto& [name, column] : points.groups()) {
        if (name.size() > longest_group_name)
            throw Error(fmt::format("the group \"{}\" can't be written to .bgeo; its name must have at most {} bytes",
                                    name, longest_group_name));
        section.string(name);
        section.int32(points.size());
        std::vector<std::uint32_t> words(words_of(points.size()));
        const Strided<std::uint8_t> members = column.read();
        for (std::size_t i = 0; i < points.size(); ++i)
            words[i / 32] |= static_cast<std::uint32_t>(members[i] != 0) << i % 32;
        for (const std::uint32_t word : words) section.int32(word);
    }
    return section.text();
}

constexpr std::int32_t polygon = 1;
constexpr std::uint32_t run_of_primitives = 0xffffffff;
constexpr char closed_mark = '<', open_mark = ':';

// Returns the bytes of a point index in a primitive.
constexpr std::size_t index_bytes(std::size_t points) { return points < 65536 ? 2 : 4; }

std::string line_section(const PointLines& lines)
{
    BigEndianText section;
    const bool is_short = index_bytes(lines.points.size()) == 2;
    std::size_t next = 0;
    for (const std::uint32_t size : lines.sizes) {
        section.int32(polygon);
        section.int32(size);
        section.bytes({&open_mark, 1});
        for (const std::size_t end = next + size; next < end; ++next)
            is_short ? section.int16(lines.vertices[next]) : section.int32(lines.vertices[next]);
    }
    return section.text();
}

constexpr std::size_t count_offset = 9;  // file offset of the number of points
constexpr std::string_view end_section("\x00\xff", 2);

void check_count(std::size_t points)
{
    if (points > 0x7fffffff) throw Error(fmt::format("{} points are too many for .bgeo; write .vdb", points));
}

// The points in the form of records: strings are replaced by their index, an int32.
struct Recorded {
    PointSet points;
    std::map<std::string, std::vector<Token>> strings;  // strings of each attribute, by index
};

Recorded recorded(const PointSet& points)
{
    Recorded result{points, {}};
    for (const std::string& name : string_column_names(points)) {
        TextTable table = text_table(points.column<Token>(name));
        for (const Token text : table.strings)
            if (text.text().size() > longest_text)
                throw Error(fmt::format("the attribute \"{}\" has a string of {} bytes; .bgeo can store at most {}",
                                        name, text.text().size(), longest_text));
        result.points.set(name, std::move(table.indices));
        result.strings[name] = std::move(table.strings);
    }
    return result;
}

// Returns the part before the records.
std::string header_section(const Recorded& recorded, const std::vector<std::string>& names, std::size_t lines)
{
    BigEndianText header;
    const PointSet& points = recorded.points;
    header.bytes("BgeoV");
    for (const std::size_t count : {std::size_t{5}, points.size(), lines, points.groups().size(), std::size_t{0},
                                    names.size(), std::size_t{0}, std::size_t{0}, std::size_t{0}})
        header.int32(count);
    for (const std::string& name : names) {
        const AnyColumn& column = *points.find(name);
        header.string(name);
        header.int16(component_count(type_of(column)));
        if (const auto strings = recorded.strings.find(name); strings != recorded.strings.end()) {
            header.int32(IndexType);
            header.int32(strings->second.size());
            for (const Token text : strings->second) header.string(text.text());
            continue;
        }
        header.int32(houdini_type(name, type_of(column)));
        for (const std::uint32_t word : default_words(column)) header.int32(word);
    }
    return header.text();
}

// Returns the names of the attributes except P.
std::vector<std::string> attribute_names(const PointSet& points)
{
    std::vector<std::string> names = further_attributes(points);
    names.insert(names.begin(), {"v", "id"});
    check_column_names(names, std::string_view("\0", 1));
    return names;
}

RecordWriter records_of(const PointSet& points, const std::vector<std::string>& names)
{
    RecordWriter records(ByteOrder::Big);
    records.add("P", *points.find("P"));
    records.add_constant(1.0f);
    for (const std::string& name : names) records.add(name, *points.find(name));
    return records;
}

void write_bgeo(OutputFile& file, const PointSet& given, const FrameInfo&)
{
    const PointLines lines = with_lines(given);
    const Recorded in_file = recorded(lines.points);
    const PointSet& points = in_file.points;
    check_count(points.size());
    const std::vector<std::string> names = attribute_names(points);
    check_column_names(points.group_names(), std::string_view("\0", 1));
    const std::string end = line_section(lines) + group_section(points) + std::string(end_section);
    const RecordWriter records = records_of(points, names);
    const std::string header = header_section(in_file, names, lines.sizes.size());

    file.append(header.data(), header.size());
    records.write(file, file.appended(), points.size());
    file.write_at(file.appended() + records.record_bytes() * points.size(), end.data(), end.size());
}

class BgeoStream : public PointStream {
public:
    BgeoStream(OutputFile& file, const PointSet& like) : file_(file), names_(attribute_names(like))
    {
        const std::string header = header_section({like, {}}, names_, 0);
        file_.append(header.data(), header.size());
        end_ = file_.appended();
    }
    void append(const PointSet& points) override
    {
        check_count(count_ + points.size());
        const RecordWriter records = records_of(points, names_);
        records.write(file_, end_, points.size());
        end_ += records.record_bytes() * points.size();
        count_ += points.size();
    }
    void finish() override
    {
        file_.write_at(end_, end_section.data(), end_section.size());
        BigEndianText count;
        count.int32(count_);
        file_.write_at(count_offset, count.text().data(), count.text().size());
    }

private:
    OutputFile& file_;
    const std::vector<std::string> names_;
    std::uint64_t end_ = 0;
    std::size_t count_ = 0;
};

// A stream supports no strings, because they precede the points that use them.
std::unique_ptr<PointStream> stream_bgeo(OutputFile& file, const PointSet& like)
{
    if (!string_column_names(like).empty()) return nullptr;
    return std::make_unique<BgeoStream>(file, like);
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
    void enter(std::string_view section) { section_ = section; }
    std::span<const unsigned char> take(std::size_t size)
    {
        if (size > bytes_.size()) throw Error(fmt::format("the file ends within its {}", section_));
        const auto taken = bytes_.first(size);
        bytes_ = bytes_.subspan(size);
        return taken;
    }

private:
    std::span<const unsigned char> bytes_;
    std::string_view section_ = "header";
};

// The attribute dictionary, which determines the layout of a record.
struct Dictionary {
    std::vector<RecordAttribute> attributes;
    std::size_t stride;
    std::vector<std::vector<std::uint32_t>> defaults = {};   // of the attributes, as words
    std::map<std::string, std::vector<Token>> strings = {};  // of the attributes that store indices of strings
};

void set_default(PointSet& points, const std::string& name, const std::vector<std::uint32_t>& words)
{
    AnyColumn* column = points.find(name);
    if (!column) return;  // the numbers were split into several columns
    std::visit(
        [&]<class T>(Column<T>& c) {
            if constexpr (std::is_same_v<T, std::int64_t>) {
                if (words.size() == 1) c.set_fallback(static_cast<std::int32_t>(words[0]));
            } else if (words.size() * 4 == sizeof(T)) {
                T value;
                std::memcpy(static_cast<void*>(&value), words.data(), sizeof value);
                c.set_fallback(value);
            }
        },
        *column);
}

// before: bytes of a record before its first attribute.
Dictionary read_dictionary(BigEndianReader& reader, std::uint32_t count, std::size_t before)
{
    Dictionary dictionary{{}, before};
    for (std::uint32_t a = 0; a < count; ++a) {
        const std::string name = reader.string(reader.integer(2));
        const std::size_t size = reader.integer(2);
        const std::uint32_t type = reader.integer(4);
        std::size_t& stride = dictionary.stride;
        if (type == FloatType || type == IntType || type == VectorType) {
            std::vector<std::uint32_t>& words = dictionary.defaults.emplace_back();
            for (std::size_t c = 0; c < size; ++c) words.push_back(reader.integer(4));
            RecordAttribute& attribute = dictionary.attributes.emplace_back();
            attribute.name = name;
            attribute.type = type == IntType ? ScalarType::Int32 : ScalarType::Float;
            for (std::size_t c = 0; c < size; ++c) attribute.offsets.push_back(stride + 4 * c);
            stride += 4 * size;
        } else if (type == TextType) {
            reader.take(size);  // default value
            stride += size;
            SkippedContents::add(fmt::format("the attribute \"{}\", a string", name));
        } else if (type == IndexType) {
            std::vector<Token> strings;
            for (std::uint32_t entries = reader.integer(4); entries > 0; --entries)
                strings.push_back(token_of(reader.string(reader.integer(2))));
            if (size == 1) {
                dictionary.attributes.push_back({name, ScalarType::Int32, {stride}});
                dictionary.defaults.emplace_back();
                dictionary.strings[name] = std::move(strings);
            } else {
                SkippedContents::add(fmt::format("the attribute \"{}\" with {} strings per point", name, size));
            }
            stride += 4 * size;
        } else {
            throw Error(fmt::format("attribute \"{}\" has the unknown type {}", name, type));
        }
    }
    std::vector<std::string> names;
    for (const RecordAttribute& attribute : dictionary.attributes) names.push_back(attribute.name);
    check_column_names(names, "");
    return dictionary;
}

// Reads the dictionary of attributes that belong to no point. Returns their size in bytes.
std::size_t stride_of_unread(BigEndianReader& reader, std::uint32_t count)
{
    const Dictionary dictionary = read_dictionary(reader, count, 0);
    for (const RecordAttribute& attribute : dictionary.attributes)
        SkippedContents::add(fmt::format("the attribute \"{}\", which does not belong to points", attribute.name));
    return dictionary.stride;
}

// Reads polygons with any attributes; open ones become lines. Returns false at another kind of primitive, whose size is
// unknown.
bool read_lines(BigEndianReader& reader, std::uint32_t primitives, std::size_t vertex_bytes, std::size_t polygon_bytes,
                PointLines& lines)
{
    const std::size_t number = index_bytes(lines.points.size());
    std::uint32_t closed = 0;
    for (std::uint32_t left = primitives; left > 0;) {
        std::uint32_t type = reader.integer(4), count = 1;
        if (type == run_of_primitives) count = reader.integer(2), type = reader.integer(4);
        if (type != polygon || count > left) return false;
        for (left -= count; count > 0; --count) {
            const std::uint32_t size = reader.integer(4);
            const std::uint32_t mark = reader.integer(1);
            if (mark != closed_mark && mark != open_mark) return false;
            const bool is_line = mark == open_mark && size > 1;
            for (std::uint32_t k = 0; k < size; ++k) {
                const std::uint32_t point = reader.integer(number);
                if (point >= lines.points.size())
                    throw Error(fmt::format("a polygon uses point {} of {}", point, lines.points.size()));
                reader.take(vertex_bytes);
                if (is_line) lines.vertices.push_back(point);
            }
            reader.take(polygon_bytes);
            if (is_line) lines.sizes.push_back(size);
            closed += !is_line;
        }
    }
    if (closed > 0) SkippedContents::add(fmt::format("its {} closed polygons", closed));
    return true;
}

Column<Token> dictionary_strings(const PointSet& points, const std::string& name, const std::vector<Token>& strings)
{
    const auto* indices = points.find<std::int32_t>(name);
    if (!indices) throw Error(fmt::format("the attribute \"{}\" is a string; it must be a number", name));
    return strings_at(strings, *indices);
}

void read_group(BigEndianReader& reader, PointSet& points)
{
    const bool ordered = !reader.rest().empty() && reader.rest().front() == ordered_mark;
    if (ordered) reader.take(1);
    const std::string name = reader.string(reader.integer(2));
    const std::size_t size = reader.integer(4);
    if (size != points.size())
        throw Error(fmt::format("the group \"{}\" has {} points, but the file has {}", name, size, points.size()));
    BigEndianReader words(reader.take(4 * words_of(size)));
    Column<std::uint8_t> column;
    const std::span<std::uint8_t> members = column.append_for_writing(size);
    std::uint32_t word = 0;
    for (std::size_t i = 0; i < size; ++i, word >>= 1) {
        if (i % 32 == 0) word = words.integer(4);
        members[i] = word & 1;
    }
    points.group(name) = std::move(column);
    if (!ordered) return;
    // The members in order. A negative one is followed by the number of a curve.
    for (std::uint32_t left = reader.integer(4); left > 0; --left)
        if (static_cast<std::int32_t>(reader.integer(4)) < 0) reader.take(4);
}

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
    const std::uint32_t primitives = reader.integer(4), groups = reader.integer(4);
    reader.take(4);  // primitive groups, which follow the point groups
    const std::uint32_t attributes = reader.integer(4), of_vertices = reader.integer(4),
                        of_primitives = reader.integer(4), of_the_whole = reader.integer(4);

    constexpr std::size_t position_bytes = 16;
    Dictionary dictionary = read_dictionary(reader, attributes, position_bytes);
    dictionary.attributes.insert(dictionary.attributes.begin(), {"P", ScalarType::Float, {0, 4, 8}});
    if (n > reader.rest().size() / dictionary.stride)
        throw Error(fmt::format("the file ends early: its header announces {} points, but it contains {}", n,
                                reader.rest().size() / dictionary.stride));
    PointSet points =
        read_records({reader.take(n * dictionary.stride), n, dictionary.stride, ByteOrder::Big}, dictionary.attributes);
    for (std::size_t a = 0; a < dictionary.defaults.size(); ++a)  // P, the first attribute, has none
        set_default(points, dictionary.attributes[a + 1].name, dictionary.defaults[a]);
    for (const auto& [name, strings] : dictionary.strings) points.set(name, dictionary_strings(points, name, strings));
    PointLines lines{std::move(points), {}, {}};
    reader.enter("primitives");
    const std::size_t vertex_bytes = stride_of_unread(reader, of_vertices);
    const std::size_t polygon_bytes = stride_of_unread(reader, of_primitives);
    if (!read_lines(reader, primitives, vertex_bytes, polygon_bytes, lines)) {
        SkippedContents::add(
            fmt::format("its {} primitives{}", primitives, groups > 0 ? ", and the groups after them" : ""));
        return lines.points;
    }
    reader.enter("attributes of the whole");
    reader.take(stride_of_unread(reader, of_the_whole));
    reader.enter("groups");
    for (std::uint32_t g = 0; g < groups; ++g) read_group(reader, lines.points);
    reader.enter("extra section");  // the shortest possible one, which every writer of the format appends
    reader.take(end_section.size());
    if (lines.points.find_group(trail_places_group)) return without_trail_places(std::move(lines.points));
    return in_order_of_lines(lines);
}

RAPID_FORMAT(Format{".bgeo", "classic Houdini geometry, read by Houdini and Partio; id as int32", write_bgeo,
                    read_bgeo});
RAPID_POINT_STREAM(".bgeo", stream_bgeo);

}  // namespace
}  // namespace rapid

// .prt: Krakatoa's particles, version 1.0 of the format ("PRT File Format", Thinkbox), as Krakatoa, Frost and Partio
// read it. Version 1.1 has a longer header and is read too.
//
// Little-endian throughout:
//
//   0xc0 "PRT\r\n" 0x1a "\n" | int32: 56, header bytes | char[32] "Extensible Particle Format" | int32: 1
//   int64: points | int32: 4 | int32: channels | int32: 44, bytes per channel
//   for each channel: char[32] name, int32 type, int32 numbers per point, int32 offset in the record
//   the records of all points, as one zlib stream
//
// P is Position, v is Velocity, id is ID. Cd, N, age, life, pscale and orient have the names that Krakatoa and Frost
// give them. A group is uint8 group_NAME.
#include <fmt/format.h>
#include <zlib.h>

#include <array>
#include <cstring>
#include <memory>

#include "runtime/base/memory_budget.h"
#include "runtime/files/deflate.h"
#include "runtime/files/input_file.h"
#include "runtime/files/skipped_contents.h"
#include "runtime/io/attribute_names.h"
#include "runtime/io/format.h"
#include "runtime/io/ordered_chunks.h"
#include "runtime/io/records.h"

namespace rapid {
namespace {

constexpr std::string_view prt_magic = "\xc0PRT\r\n\x1a\n";
constexpr std::string_view signature = "Extensible Particle Format";
constexpr std::size_t header_bytes = 56, name_bytes = 32, channel_bytes = 44;

// Types by number in the file.
constexpr ScalarType channel_types[] = {ScalarType::Int16,  ScalarType::Int32,  ScalarType::Int64,  ScalarType::Half,
                                        ScalarType::Float,  ScalarType::Double, ScalarType::UInt16, ScalarType::UInt32,
                                        ScalarType::UInt64, ScalarType::Int8,   ScalarType::UInt8};
enum ChannelType : std::int32_t { Int32Channel = 1, Int64Channel = 2, FloatChannel = 4, UInt8Channel = 10 };

// Krakatoa's channel names.
constexpr std::array<std::pair<std::string_view, std::string_view>, 9> channel_names = {{{"P", "Position"},
                                                                                         {"v", "Velocity"},
                                                                                         {"id", "ID"},
                                                                                         {"Cd", "Color"},
                                                                                         {"N", "Normal"},
                                                                                         {"age", "Age"},
                                                                                         {"life", "LifeSpan"},
                                                                                         {"pscale", "Radius"},
                                                                                         {"orient", "Orientation"}}};

std::string channel_name(const std::string& attribute)
{
    for (const auto& [ours, theirs] : channel_names)
        if (attribute == ours) return std::string(theirs);
    return attribute;
}

std::string attribute_of_channel(const std::string& channel)
{
    for (const auto& [ours, theirs] : channel_names)
        if (channel == theirs) return std::string(ours);
    return channel;
}

void check_channel_name(const std::string& name)
{
    constexpr std::string_view letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_", digits = "0123456789";
    const std::string allowed = std::string(letters) + std::string(digits);
    if (name.size() >= name_bytes || name.find_first_of(letters) != 0 ||
        name.find_first_not_of(allowed) != std::string::npos)
        throw Error(
            fmt::format("the name \"{}\" can't be written to .prt; it must have at most {} letters, digits and _, and "
                        "must not begin with a digit; rename the attribute or group",
                        name, name_bytes - 1));
}

ChannelType channel_type(AttributeType type)
{
    if (type == AttributeType::Int32) return Int32Channel;
    return type == AttributeType::Int64 ? Int64Channel : FloatChannel;
}

std::string little_endian(std::uint64_t value, std::size_t bytes)
{
    std::string text;
    for (std::size_t b = 0; b < bytes; ++b) text += static_cast<char>(value >> 8 * b & 0xff);
    return text;
}

std::string padded(std::string_view text, std::size_t bytes)
{
    std::string result(text);
    result.resize(bytes, '\0');
    return result;
}

struct Layout {
    RecordWriter records{ByteOrder::Little, RecordWriter::Wide};
    std::vector<std::string> names;
    std::string channels;  // their definitions

    void add(const std::string& name, ChannelType type, std::size_t count)
    {
        check_channel_name(name);
        names.push_back(name);
        channels += padded(name, name_bytes) + little_endian(type, 4) + little_endian(count, 4) +
                    little_endian(records.record_bytes(), 4);
    }
};

Layout layout_of(const PointSet& points)
{
    Layout layout;
    std::vector<std::string> attributes = further_attributes(points);
    attributes.insert(attributes.begin(), {"P", "v", "id"});
    for (const std::string& name : attributes) {
        const AnyColumn& column = *points.find(name);
        layout.add(channel_name(name), channel_type(type_of(column)), component_count(type_of(column)));
        layout.records.add(name, column);
    }
    for (const auto& [name, members] : points.groups()) {
        layout.add(std::string(group_prefix) + name, UInt8Channel, 1);
        layout.records.add_bytes(members);
    }
    check_column_names(layout.names, "");
    return layout;
}

// Returns a chunk of a zlib stream that ends at a byte boundary.
std::string deflated(const std::vector<unsigned char>& bytes)
{
    // Higher levels take five times as long and save only 5 %, because the bits of floats are mostly noise.
    z_stream stream = {};
    if (::deflateInit2(&stream, Z_BEST_SPEED, Z_DEFLATED, -MAX_WBITS, MAX_MEM_LEVEL, Z_DEFAULT_STRATEGY) != Z_OK)
        throw std::bad_alloc();
    std::string text(::deflateBound(&stream, bytes.size()) + 16, '\0');
    stream.next_in = const_cast<unsigned char*>(bytes.data());
    stream.avail_in = static_cast<uInt>(bytes.size());
    stream.next_out = reinterpret_cast<unsigned char*>(text.data());
    stream.avail_out = static_cast<uInt>(text.size());
    [[maybe_unused]] const int result = ::deflate(&stream, Z_SYNC_FLUSH);
    RAPID_ASSERT(result == Z_OK && stream.avail_in == 0 && stream.avail_out > 0);
    text.resize(stream.total_out);
    ::deflateEnd(&stream);
    return text;
}

void write_prt(OutputFile& file, const PointSet& points, const FrameInfo&)
{
    const Layout layout = layout_of(points);
    const std::size_t record_bytes = layout.records.record_bytes();
    const std::string header = std::string(prt_magic) + little_endian(header_bytes, 4) + padded(signature, 32) +
                               little_endian(1, 4) + little_endian(points.size(), 8) + little_endian(4, 4) +
                               little_endian(layout.names.size(), 4) + little_endian(channel_bytes, 4) +
                               layout.channels + "\x78\x01";  // start of the zlib stream (RFC 1950)
    file.append(header.data(), header.size());

    // Chunks are compressed independently on all threads. The stream's checksum is combined from theirs.
    std::vector<uLong> checksums((points.size() + chunk_size - 1) / chunk_size);
    append_chunks(file, points.size(), [&](std::size_t begin, std::size_t end) {
        std::vector<unsigned char> records((end - begin) * record_bytes);
        layout.records.interleave(begin, end, records.data());
        checksums[begin / chunk_size] = ::adler32(1, records.data(), static_cast<uInt>(records.size()));
        return deflated(records);
    });
    uLong checksum = 1;
    for (std::size_t c = 0; c < checksums.size(); ++c) {
        const std::size_t size = std::min(chunk_size, points.size() - c * chunk_size);
        checksum = ::adler32_combine(checksum, checksums[c], static_cast<z_off_t>(size * record_bytes));
    }
    std::string end = "\x03";  // an empty last block, then the checksum, big-endian
    end += '\0';
    for (int shift = 24; shift >= 0; shift -= 8) end += static_cast<char>(checksum >> shift & 0xff);
    file.append(end.data(), end.size());
}

class LittleEndianReader {
public:
    explicit LittleEndianReader(std::span<const unsigned char> bytes) : bytes_(bytes) {}

    std::span<const unsigned char> rest() const { return bytes_; }
    std::span<const unsigned char> take(std::size_t size)
    {
        if (size > bytes_.size()) throw Error("the file ends within its header");
        const auto taken = bytes_.first(size);
        bytes_ = bytes_.subspan(size);
        return taken;
    }
    template <class Integer>
    Integer integer()
    {
        return load_scalar<Integer>(take(sizeof(Integer)).data(), ByteOrder::Little);
    }

private:
    std::span<const unsigned char> bytes_;
};

struct Channels {
    std::vector<RecordAttribute> attributes;
    std::size_t stride = 0;
};

RecordAttribute attribute_of(const std::string& name, ScalarType type, std::size_t count, std::size_t offset)
{
    RecordAttribute attribute;
    attribute.type = type;
    attribute.group = type == ScalarType::UInt8 && count == 1 && name.starts_with(group_prefix);
    attribute.name = attribute.group ? name.substr(group_prefix.size()) : attribute_of_channel(name);
    for (std::size_t c = 0; c < count; ++c) attribute.offsets.push_back(offset + c * scalar_bytes(type));
    return attribute;
}

Channels read_channels(LittleEndianReader& reader)
{
    Channels channels;
    std::vector<std::string> names;
    const auto count = reader.integer<std::int32_t>(), bytes = reader.integer<std::int32_t>();
    if (bytes < static_cast<std::int32_t>(channel_bytes))
        throw Error(
            fmt::format("the definition of a channel has {} bytes; it must have at least {}", bytes, channel_bytes));
    for (std::int32_t c = 0; c < count; ++c) {
        LittleEndianReader channel(reader.take(static_cast<std::size_t>(bytes)));
        const auto text = channel.take(name_bytes);
        const std::string name(text.begin(), std::find(text.begin(), text.end(), 0));
        const auto type = channel.integer<std::int32_t>(), numbers = channel.integer<std::int32_t>(),
                   offset = channel.integer<std::int32_t>();
        if (type < 0 || type >= static_cast<std::int32_t>(std::size(channel_types)))
            throw Error(fmt::format("the channel \"{}\" has the unknown type {}", name, type));
        if (numbers < 1 || numbers > 0xffff || offset < 0)
            throw Error(fmt::format("the channel \"{}\" has {} numbers per point, at {}", name, numbers, offset));
        const ScalarType scalar = channel_types[type];
        const std::size_t begin = static_cast<std::size_t>(offset), size = static_cast<std::size_t>(numbers);
        channels.stride = std::max(channels.stride, begin + size * scalar_bytes(scalar));
        names.push_back(attribute_of_channel(name));
        if (size <= max_numbers)
            channels.attributes.push_back(attribute_of(name, scalar, size, begin));
        else
            SkippedContents::add(fmt::format("the channel \"{}\" of {} numbers per point", name, numbers));
    }
    check_column_names(names, "");
    return channels;
}

PointSet read_prt(const std::filesystem::path& path)
{
    const InputFile file(path);
    LittleEndianReader reader(file.bytes());
    if (!file.text().starts_with(prt_magic)) throw Error("not a .prt file");
    reader.take(prt_magic.size());
    const auto header = reader.integer<std::int32_t>();
    if (header < static_cast<std::int32_t>(header_bytes))
        throw Error(fmt::format("its header has {} bytes; it must have at least {}", header, header_bytes));
    reader.take(32);
    const auto version = reader.integer<std::int32_t>();
    if (version != 1 && version != 2) throw Error(fmt::format("version {} can't be read; it must be 1 or 2", version));
    const auto count = reader.integer<std::int64_t>();
    if (count < 0) throw Error("it was never completed: its header has no number of points");
    reader.take(static_cast<std::size_t>(header) - header_bytes);  // additions of version 2
    reader.take(4);
    const Channels channels = read_channels(reader);
    const bool placed = std::any_of(
        channels.attributes.begin(), channels.attributes.end(),
        [](const RecordAttribute& a) { return a.name == "P" && a.offsets.size() == 3 && is_floating(a.type); });
    if (!placed) throw Error("there is no channel Position of three floats");

    const std::size_t n = static_cast<std::size_t>(count);
    const std::size_t held = reader.rest().size() * max_deflate_expansion / channels.stride;
    if (n > held)
        throw Error(
            fmt::format("the file ends early: its header announces {} points, but it contains at most {}", n, held));
    const std::size_t bytes = n * channels.stride;
    // Accounts for the records and for the points made from them.
    if (const double both = 2.0 * static_cast<double>(bytes); !fits_in_memory(both))
        throw memory_exceeded(fmt::format("{} points, decompressed,", n), both, "write fewer points to the file");
    const std::unique_ptr<unsigned char[]> records(new unsigned char[bytes]);
    uLongf found = bytes;
    const bool is_empty = n == 0 && reader.rest().empty();  // no data was compressed
    const int result =
        is_empty ? Z_OK : ::uncompress(records.get(), &found, reader.rest().data(), reader.rest().size());
    if (result == Z_MEM_ERROR) throw std::bad_alloc();
    if (found < bytes)
        throw Error(fmt::format("the file ends early or is damaged: its header announces {} points, but it contains {}",
                                n, found / channels.stride));
    if (result != Z_OK) throw Error("the compressed records are damaged");
    return read_records({{records.get(), bytes}, n, channels.stride, ByteOrder::Little}, channels.attributes);
}

RAPID_FORMAT(Format{".prt", "Krakatoa's particles, compressed; all types but strings", write_prt, read_prt,
                    /*film=*/false, /*positions_only=*/false, /*holds_strings=*/false});

}  // namespace
}  // namespace rapid

#include "runtime/io/vtk_arrays.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <map>
#include <new>
#include <string>

#include "runtime/error.h"
#include "runtime/files/base64.h"
#include "runtime/files/deflate.h"
#include "runtime/io/attribute_names.h"
#include "runtime/io/text_table.h"
#include "runtime/memory_budget.h"

namespace rapid {
namespace {

constexpr std::string_view xml_space = " \t\r\n";

std::optional<ScalarType> scalar_type(std::string_view name)
{
    static const std::map<std::string_view, ScalarType> types = {
        {"Int8", ScalarType::Int8},     {"UInt8", ScalarType::UInt8},   {"Int16", ScalarType::Int16},
        {"UInt16", ScalarType::UInt16}, {"Int32", ScalarType::Int32},   {"UInt32", ScalarType::UInt32},
        {"Int64", ScalarType::Int64},   {"UInt64", ScalarType::UInt64}, {"Float32", ScalarType::Float},
        {"Float64", ScalarType::Double}};
    const auto found = types.find(name);
    return found == types.end() ? std::nullopt : std::optional(found->second);
}

Error ends_early() { return Error("the array ends early"); }

std::string_view without_space(std::string_view text)
{
    text.remove_prefix(std::min(text.find_first_not_of(xml_space), text.size()));
    return text;
}

// Parses numbers to the machine's binary format.
std::vector<unsigned char> parsed_numbers(std::string_view text, ScalarType type, std::size_t count)
{
    if (count > (text.size() + 1) / 2) throw ends_early();  // a digit each, separated by spaces
    std::vector<unsigned char> bytes(count * scalar_bytes(type));
    with_scalar(type, [&](auto like) {
        using Number = std::conditional_t<std::is_same_v<decltype(like), Half>, float, decltype(like)>;
        for (std::size_t i = 0; i < count; ++i) {
            text = without_space(text);
            Number number = 0;
            const auto parsed = std::from_chars(text.data(), text.data() + text.size(), number);
            text.remove_prefix(static_cast<std::size_t>(parsed.ptr - text.data()));
            if (parsed.ec != std::errc() || (!text.empty() && xml_space.find(text[0]) == std::string_view::npos))
                throw Error(fmt::format("the array has no number of its type where it should have its {}", i));
            std::memcpy(bytes.data() + i * sizeof number, &number, sizeof number);
        }
        if (!without_space(text).empty()) throw Error(fmt::format("the array has more than its {} numbers", count));
    });
    return bytes;
}

}  // namespace

std::optional<std::size_t> whole_number(std::string_view text)
{
    std::size_t number = 0;
    const auto parsed = std::from_chars(text.data(), text.data() + text.size(), number);
    if (parsed.ec != std::errc() || parsed.ptr != text.data() + text.size()) return {};
    return number;
}

VtkFile::VtkFile(std::string_view text, std::string_view type)
{
    // The appended section is not XML if it is raw.
    const std::size_t appended = text.find("<AppendedData");
    std::string xml(text.substr(0, appended));
    if (appended != std::string_view::npos) {
        const std::size_t tag_end = text.find('>', appended);
        const std::size_t begin = tag_end == std::string_view::npos ? tag_end : text.find('_', tag_end);
        const std::size_t last = text.find_last_not_of(xml_space);
        if (begin == std::string_view::npos || !text.substr(0, last + 1).ends_with("</VTKFile>"))
            throw Error("the file ends within its AppendedData");
        appended_base64_ = text.substr(appended, tag_end - appended).find("base64") != std::string_view::npos;
        appended_ = text.substr(begin + 1);
        xml += "</VTKFile>";
    }
    const pugi::xml_parse_result parsed = document_.load_buffer(xml.data(), xml.size());
    const pugi::xml_node root = document_.child("VTKFile");
    if (!root) throw Error("not a file of VTK: it has no element VTKFile");
    if (!parsed) throw Error(fmt::format("its XML is damaged: {}", parsed.description()));
    if (root.attribute("type").value() != type)
        throw Error(
            fmt::format("it holds {}; it must hold {}", root.attribute("type").as_string("no type of data"), type));
    if (root.attribute("byte_order").value() == std::string_view("BigEndian")) order_ = ByteOrder::Big;
    wide_header_ = root.attribute("header_type").value() == std::string_view("UInt64");
    const std::string_view compressor = root.attribute("compressor").value();
    compressed_ = !compressor.empty();
    if (compressed_ && compressor != "vtkZLibDataCompressor")
        throw Error(
            fmt::format("it is compressed by {}; it must be by vtkZLibDataCompressor, or not at all", compressor));
}

std::size_t VtkFile::header_number(std::span<const unsigned char> bytes, std::size_t index) const
{
    if (wide_header_) return load_scalar<std::uint64_t>(bytes.data() + 8 * index, order_);
    return load_scalar<std::uint32_t>(bytes.data() + 4 * index, order_);
}

std::span<const unsigned char> VtkFile::raw(std::string_view text, std::size_t wanted) const
{
    const std::size_t header = wide_header_ ? 8 : 4;
    const auto* bytes = reinterpret_cast<const unsigned char*>(text.data());
    if (text.size() < header || header_number({bytes, header}, 0) < wanted || wanted > text.size() - header)
        throw ends_early();
    return {bytes + header, wanted};
}

std::vector<unsigned char> VtkFile::decode(std::string_view text, bool base64, std::size_t wanted) const
{
    const std::size_t number = wide_header_ ? 8 : 4;
    // Returns the next bytes. In Base64 the header and the data are encoded separately, and the header as a whole.
    const auto bytes_at = [&](std::size_t count, std::size_t& length) {
        if (base64) return from_base64(text, count, length);
        if (count > text.size()) throw ends_early();
        length = count;
        const auto* begin = reinterpret_cast<const unsigned char*>(text.data());
        return std::vector<unsigned char>(begin, begin + count);
    };
    std::size_t length = 0;
    if (!compressed_) {
        // A byte count, then the data, encoded together.
        if (header_number(bytes_at(number, length), 0) < wanted || wanted > text.size()) throw ends_early();
        std::vector<unsigned char> bytes = bytes_at(number + wanted, length);
        bytes.erase(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(number));
        return bytes;
    }
    // The number of blocks, the size of each and of the last one (0: like the others), then the compressed size of
    // each.
    const std::size_t blocks = header_number(bytes_at(3 * number, length), 0);
    if (blocks > text.size() / number) throw ends_early();
    const std::vector<unsigned char> header = bytes_at((3 + blocks) * number, length);
    text.remove_prefix(length);
    const std::size_t block = header_number(header, 1), last = header_number(header, 2);
    std::size_t packed = 0;
    for (std::size_t b = 0; b < blocks; ++b) {
        const std::size_t bytes = header_number(header, 3 + b);
        if (bytes > text.size()) throw ends_early();
        packed += bytes;
        if (packed > text.size()) throw ends_early();
    }
    if (wanted / most_deflate_expansion > packed) throw ends_early();
    const std::vector<unsigned char> data = bytes_at(packed, length);
    if (const auto all = static_cast<double>(wanted); !fits_in_memory(all))
        throw beyond_memory("an array, decompressed,", all, "write fewer points to the file");
    std::vector<unsigned char> result(wanted);
    std::size_t from = 0, to = 0;
    for (std::size_t b = 0; b < blocks; ++b) {
        const std::size_t size = b + 1 == blocks && last > 0 ? last : block;
        const std::size_t packed_size = header_number(header, 3 + b);
        if (size > result.size() - to) throw Error("the blocks of the array hold more than its numbers");
        uLongf found = size;
        const int status = ::uncompress(result.data() + to, &found, data.data() + from, packed_size);
        if (status == Z_MEM_ERROR) throw std::bad_alloc();
        if (status != Z_OK || found != size) throw Error("a compressed block of the array is damaged");
        from += packed_size;
        to += size;
    }
    if (to < wanted) throw ends_early();
    return result;
}

std::size_t VtkFile::bytes_of(std::string_view text, bool base64) const
{
    const std::size_t number = wide_header_ ? 8 : 4;
    const auto header = [&](std::size_t count) {
        std::size_t length = 0;
        if (base64) return from_base64(text, count * number, length);
        if (count * number > text.size()) throw ends_early();
        const auto* begin = reinterpret_cast<const unsigned char*>(text.data());
        return std::vector<unsigned char>(begin, begin + count * number);
    };
    if (!compressed_) return header_number(header(1), 0);
    const std::vector<unsigned char> sizes = header(3);
    const std::size_t blocks = header_number(sizes, 0), block = header_number(sizes, 1), last = header_number(sizes, 2);
    if (blocks > text.size() / number || block > text.size() * most_deflate_expansion) throw ends_early();
    return blocks == 0 ? 0 : (blocks - 1) * block + (last > 0 ? last : block);
}

std::pair<std::string_view, bool> VtkFile::data_of(pugi::xml_node node, std::string_view text) const
{
    const std::string_view format = node.attribute("format").value();
    if (format == "binary") return {text, true};
    if (format != "appended")
        throw Error(fmt::format("its format is \"{}\"; it must be ascii, binary or appended", format));
    const std::optional<std::size_t> offset = whole_number(node.attribute("offset").value());
    if (!offset || *offset > appended_.size()) throw Error("its offset leads out of the file");
    return {appended_.substr(*offset), appended_base64_};
}

std::vector<Token> VtkFile::texts(pugi::xml_node node, std::size_t rows) const
{
    try {
        const std::string_view text = without_space(node.text().get());
        std::vector<unsigned char> bytes;
        if (node.attribute("format").value() == std::string_view("ascii")) {
            // The bytes are stored as numbers.
            std::size_t count = 0;
            for (std::size_t i = 0; i < text.size(); ++i)
                count += xml_space.find(text[i]) == std::string_view::npos &&
                         (i == 0 || xml_space.find(text[i - 1]) != std::string_view::npos);
            bytes = parsed_numbers(text, ScalarType::UInt8, count);
        } else {
            const auto [data, base64] = data_of(node, text);
            const std::size_t size = bytes_of(data, base64);
            if (!base64 && !compressed_) {
                const std::span<const unsigned char> in_file = raw(data, size);
                bytes.assign(in_file.begin(), in_file.end());
            } else {
                bytes = decode(data, base64, size);
            }
        }
        std::vector<Token> texts;
        TokensOfTexts token_of_row;
        for (auto at = bytes.begin(); texts.size() < rows;) {
            const auto end = std::find(at, bytes.end(), 0);
            if (end == bytes.end()) throw ends_early();
            texts.push_back(token_of_row(std::string(at, end)));
            at = end + 1;
        }
        return texts;
    } catch (const Error& error) {
        throw Error(fmt::format("the array \"{}\" of {} texts: {}", node.attribute("Name").value(), rows, error.what()),
                    error.kind());
    }
}

std::optional<VtkArray> VtkFile::array(pugi::xml_node node, std::size_t rows) const
{
    if (!node) throw Error("an array is missing");
    const std::string_view name = node.attribute("Name").value(), format = node.attribute("format").value();
    const std::optional<ScalarType> type = scalar_type(node.attribute("type").value());
    const pugi::xml_attribute components = node.attribute("NumberOfComponents");
    const std::size_t numbers = components ? whole_number(components.value()).value_or(0) : 1;
    if (!type || numbers < 1 || numbers > most_numbers) return {};
    VtkArray array{*type, numbers, order_, {}, {}};
    const std::size_t row = numbers * scalar_bytes(*type);
    try {
        if (rows > (std::size_t{1} << 48)) throw ends_early();
        const std::string_view text = without_space(node.text().get());
        if (format == "ascii") {
            array.decoded = parsed_numbers(text, *type, rows * numbers);
            array.order = ByteOrder::Little;
        } else {
            const auto [data, base64] = data_of(node, text);
            if (!base64 && !compressed_) {
                array.bytes = raw(data, rows * row);
                return array;
            }
            array.decoded = decode(data, base64, rows * row);
        }
    } catch (const Error& error) {
        throw Error(fmt::format("the array \"{}\" of {} rows: {}", name, rows, error.what()), error.kind());
    }
    array.bytes = array.decoded;
    return array;
}

}  // namespace rapid

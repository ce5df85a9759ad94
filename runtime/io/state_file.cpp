#include "runtime/io/state_file.h"

#include <blosc.h>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <functional>
#include <memory>
#include <string_view>
#include <utility>

#include "runtime/base/error.h"
#include "runtime/base/json.h"
#include "runtime/base/per_thread.h"
#include "runtime/files/content_hash.h"
#include "runtime/files/output_file.h"
#include "runtime/io/text_table.h"

namespace rapid {
namespace {

constexpr std::string_view state_magic = "\x89RAPID\r\n";
constexpr int max_depth = 8;  // nesting in a header: copying JSON recurses per level
constexpr std::string_view types[] = {"float", "vec3", "int32", "int64", "quat", "string", "uint8"};  // SavedColumn's
static_assert(std::size(types) == std::variant_size_v<SavedColumn>);
constexpr std::string_view type_of_bytes = "bytes";

// Pieces are compressed and read on all threads. Blosc groups the bytes of numbers by significance, which shrinks ids
// to 1 %. LZ4 at level 1 reads and writes gigabytes per second. It only saves a tenth of positions and velocities,
// which takes more time than writing that tenth, so blocks that do not shrink to half are stored uncompressed.
constexpr std::size_t piece_bytes = std::size_t{1} << 20;
constexpr std::size_t sample_bytes = std::size_t{1} << 16;
constexpr double worthwhile = 0.5;  // largest compressed fraction of a sample
constexpr int level = 1;
constexpr const char* codec = "lz4";
constexpr std::uint64_t max_codec_expansion = 1024;  // more than any codec achieves

// A block before compression.
struct Raw {
    const char* data;
    std::size_t bytes, scalar;  // scalar: bytes per number

    std::size_t pieces() const { return (bytes + piece_bytes - 1) / piece_bytes; }
};

// A piece as stored in the file.
struct Piece {
    std::unique_ptr<char[]> packed;  // null: the block's own bytes are used
    std::span<const char> bytes;
};

// Compresses into a buffer for the worst case, one per thread. The returned piece is copied to its exact size.
Piece packed(std::span<const char> bytes, std::size_t scalar)
{
    thread_local PerThread<std::vector<char>> kept;
    std::vector<char>& room = *kept;
    room.resize(piece_bytes + BLOSC_MAX_OVERHEAD);
    const int size = blosc_compress_ctx(level, BLOSC_SHUFFLE, scalar, bytes.size(), bytes.data(), room.data(),
                                        bytes.size() + BLOSC_MAX_OVERHEAD, codec, 0, 1);
    if (size <= 0) throw Error("can't be compressed");
    const auto fewer = static_cast<std::size_t>(size);
    if (fewer >= bytes.size()) return {nullptr, bytes};
    auto smaller = std::make_unique_for_overwrite<char[]>(fewer);
    std::memcpy(smaller.get(), room.data(), fewer);
    const std::span<const char> content(smaller.get(), fewer);
    return {std::move(smaller), content};
}

bool is_worth_packing(const Raw& raw)
{
    if (raw.bytes == 0) return false;
    const std::size_t size = std::min(raw.bytes, sample_bytes);
    const std::size_t at = (raw.bytes - size) / 2 / raw.scalar * raw.scalar;
    return static_cast<double>(packed({raw.data + at, size}, raw.scalar).bytes.size()) <=
           worthwhile * static_cast<double>(size);
}

[[noreturn]] void damaged(const char* how) { throw Error(fmt::format("{}; it is not a complete snapshot", how)); }

// Decompresses a piece. One as large as its content is stored uncompressed.
void unpack(std::string_view piece, char* data, std::size_t bytes)
{
    if (piece.size() == bytes) {
        std::memcpy(data, piece.data(), bytes);
        return;
    }
    std::size_t known = 0;
    if (blosc_cbuffer_validate(piece.data(), piece.size(), &known) != 0 || known != bytes ||
        blosc_decompress_ctx(piece.data(), data, bytes, 1) != static_cast<int>(bytes))
        damaged("a block does not fit its header");
}

template <class T>
constexpr std::size_t number_bytes = sizeof(T) % sizeof(float) == 0 && !std::is_integral_v<T> ? sizeof(float)
                                                                                              : sizeof(T);

Raw raw_of(const SavedColumn& column)
{
    return std::visit(
        []<class T>(const Column<T>& values) -> Raw {
            return {reinterpret_cast<const char*>(values.read().data), values.bytes(), number_bytes<T>};
        },
        column);
}

std::size_t values_of(const SavedColumn& column)
{
    return std::visit([](const auto& values) { return values.size(); }, column);
}

// Replaces table indices by strings in string columns.
void take_strings(const CheckedJson& blocks, SavedState& state)
{
    for (std::size_t k = 0; k < state.columns.size(); ++k) {
        const auto found = blocks[k + 1].find("texts");
        if (found == blocks[k + 1].end()) continue;
        std::vector<Token> strings;
        try {
            for (const CheckedJson& text : *found) strings.push_back(token_of(text.get<std::string>()));
            state.columns[k] = strings_at(strings, std::get<Column<std::int32_t>>(state.columns[k]));
        } catch (const CheckedJson::exception&) {
            damaged("its header can't be read");
        } catch (const std::bad_variant_access&) {
            damaged("a block does not fit its header");
        }
    }
}

std::uint64_t number_at(const char* at)
{
    std::uint64_t number;
    std::memcpy(&number, at, sizeof number);
    return number;
}

void write_to(const std::function<void(const void* data, std::size_t bytes)>& write, CheckedJson header,
              const SavedState& state)
{
    std::vector<Raw> blocks = {{state.bytes.data(), state.bytes.size(), sizeof(double)}};
    // For a string column the block contains table indices and the header the strings.
    std::vector<SavedColumn> columns = state.columns;
    std::vector<std::vector<Token>> strings(columns.size());
    for (std::size_t k = 0; k < columns.size(); ++k)
        if (const auto* tokens = std::get_if<Column<Token>>(&columns[k])) {
            TextTable table = text_table(*tokens);
            strings[k] = std::move(table.strings);
            columns[k] = std::move(table.indices);
        }
    for (const SavedColumn& column : columns) blocks.push_back(raw_of(column));
    std::vector<std::pair<std::size_t, std::size_t>> locations;  // block and offset of each piece
    for (std::size_t b = 0; b < blocks.size(); ++b)
        for (std::size_t k = 0; k < blocks[b].pieces(); ++k) locations.emplace_back(b, k * piece_bytes);
    std::vector<std::uint8_t> is_packed(blocks.size());
    tbb::parallel_for(std::size_t{0}, blocks.size(),
                      [&](std::size_t b) { is_packed[b] = is_worth_packing(blocks[b]); });
    std::vector<Piece> pieces(locations.size());
    tbb::parallel_for(std::size_t{0}, locations.size(), [&](std::size_t k) {
        const auto& [b, at] = locations[k];
        const std::span<const char> bytes(blocks[b].data + at, std::min(piece_bytes, blocks[b].bytes - at));
        pieces[k] = is_packed[b] ? packed(bytes, blocks[b].scalar) : Piece{nullptr, bytes};
    });
    header["format"] = state_format;
    CheckedJson& list = header["blocks"] = CheckedJson::array();
    for (std::size_t b = 0, next = 0; b < blocks.size(); ++b) {
        CheckedJson sizes = CheckedJson::array();
        for (std::size_t k = 0; k < blocks[b].pieces(); ++k) sizes.push_back(pieces[next++].bytes.size());
        list.push_back({{"type", b == 0 ? type_of_bytes : types[state.columns[b - 1].index()]},
                        {"values", b == 0 ? state.bytes.size() : values_of(state.columns[b - 1])},
                        {"pieces", std::move(sizes)}});
        if (b == 0 || !std::holds_alternative<Column<Token>>(state.columns[b - 1])) continue;
        CheckedJson& of_block = list.back()["texts"] = CheckedJson::array();
        for (const Token text : strings[b - 1]) of_block.push_back(text.text());
    }

    ContentHash hash;
    const auto append = [&](const void* data, std::size_t bytes) {
        hash.add(data, bytes);
        write(data, bytes);
    };
    const std::string text = json_text(header, 1);
    const std::uint64_t length = text.size();
    append(state_magic.data(), state_magic.size());
    append(&length, sizeof length);
    append(text.data(), text.size());
    for (const Piece& piece : pieces) append(piece.bytes.data(), piece.bytes.size());
    const std::uint64_t digest = hash.value();
    write(&digest, sizeof digest);
}

}  // namespace

void write_state(const std::filesystem::path& path, CheckedJson header, const SavedState& state)
{
    OutputFile file(path);
    write_to([&](const void* data, std::size_t bytes) { file.append(data, bytes); }, std::move(header), state);
    file.finish();
}

std::string text_of_state(CheckedJson header, const SavedState& state)
{
    std::string text;
    write_to([&](const void* data, std::size_t bytes) { text.append(static_cast<const char*>(data), bytes); },
             std::move(header), state);
    return text;
}

bool StateFile::is_one(const std::filesystem::path& path)
{
    std::error_code none;
    if (!std::filesystem::is_regular_file(path, none)) return false;  // opening a pipe would block
    std::ifstream file(path, std::ios::binary);
    std::array<char, state_magic.size()> head{};
    return file.read(head.data(), head.size()) && std::string_view(head.data(), head.size()) == state_magic;
}

StateFile::StateFile(Content content) : content_(std::move(content))
{
    const std::string_view all = text();
    constexpr std::size_t ends = state_magic.size() + 2 * sizeof(std::uint64_t);
    if (all.size() < ends || !all.starts_with(state_magic)) damaged("it does not begin like one");
    const std::size_t body = all.size() - sizeof(std::uint64_t);
    if (content_hash(all.substr(0, body)) != number_at(all.data() + body)) damaged("its checksum is wrong");
    const std::uint64_t length = number_at(all.data() + state_magic.size());
    const std::size_t begin = state_magic.size() + sizeof length;
    if (length > body - begin) damaged("its header is longer than the file");
    blocks_at_ = begin + static_cast<std::size_t>(length);
    try {
        header_ = CheckedJson::parse(all.substr(begin, static_cast<std::size_t>(length)),
                                     [](int depth, CheckedJson::parse_event_t, CheckedJson&) {
                                         if (depth > max_depth) damaged("its header is nested too deep");
                                         return true;
                                     });
        if (!header_.is_object()) damaged("its header can't be read");
        if (header_.at("format").get<int>() != state_format)
            throw Error(fmt::format("it has the format {} of snapshots; this Rapid reads {}",
                                    header_.at("format").get<int>(), state_format));
    } catch (const CheckedJson::exception&) {
        damaged("its header can't be read");
    }
}

SavedState StateFile::state() const
{
    SavedState state;
    std::size_t at = blocks_at_;
    const std::string_view all = text();
    const std::size_t end = all.size() - sizeof(std::uint64_t);
    struct PieceLocation {
        std::string_view piece;
        char* to;
        std::size_t bytes;
    };
    std::vector<PieceLocation> locations;
    // Allocates no more memory than a file of this size can decompress to.
    std::uint64_t left = (end - at) * max_codec_expansion;
    const auto add = [&](const CheckedJson& block, std::size_t bytes_per_value, const auto& allocate) {
        const std::uint64_t values = block.at("values").get<std::uint64_t>();
        if (values > left / bytes_per_value) damaged("a block does not fit its header");
        const std::size_t bytes = static_cast<std::size_t>(values) * bytes_per_value;
        left -= bytes;
        char* const to = allocate(static_cast<std::size_t>(values));
        std::size_t done = 0;
        for (const CheckedJson& piece : block.at("pieces")) {
            const std::uint64_t size = piece.get<std::uint64_t>();
            if (size > end - at) damaged("it is shorter than its header says");
            const std::size_t filled = std::min(piece_bytes, bytes - done);
            locations.push_back({all.substr(at, static_cast<std::size_t>(size)), to + done, filled});
            at += static_cast<std::size_t>(size);
            done += filled;
        }
        if (done != bytes) damaged("a block does not fit its header");
    };
    try {
        const CheckedJson& blocks = header_.at("blocks");
        if (blocks.empty() || blocks[0].at("type") != type_of_bytes) damaged("its header can't be read");
        add(blocks[0], 1, [&](std::size_t size) { return state.bytes.resize(size), state.bytes.data(); });
        state.columns.reserve(blocks.size() - 1);
        for (std::size_t k = 1; k < blocks.size(); ++k) {
            const auto found = std::find(std::begin(types), std::end(types), blocks[k].at("type").get<std::string>());
            if (found == std::end(types)) damaged("its header can't be read");
            const bool is_of_strings = *found == type_name(AttributeType::String);
            std::visit(
                [&]<class T>(Column<T>& column) {
                    add(blocks[k], sizeof(T), [&](std::size_t size) {
                        return reinterpret_cast<char*>(column.append_for_writing(size).data());
                    });
                },
                state.columns.emplace_back(
                    is_of_strings ? SavedColumn(Column<std::int32_t>())
                                  : column_of_type<SavedColumn>(static_cast<std::size_t>(found - std::begin(types)))));
        }
    } catch (const CheckedJson::exception&) {
        damaged("its header can't be read");
    }
    tbb::parallel_for(std::size_t{0}, locations.size(),
                      [&](std::size_t k) { unpack(locations[k].piece, locations[k].to, locations[k].bytes); });
    take_strings(header_.at("blocks"), state);
    return state;
}

}  // namespace rapid

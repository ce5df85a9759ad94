#include "runtime/io/state_file.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <xxhash.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <memory>
#include <new>
#include <string_view>

#include "runtime/error.h"

namespace rapid {
namespace {

using nlohmann::ordered_json;

constexpr std::string_view magic = "\x89RAPID\r\n";
constexpr int format = 1;
constexpr int level = 1;                                                                                 // of zstd
constexpr std::array<std::string_view, 6> types = {"float", "vec3", "int32", "int64", "quat", "uint8"};  // KeptColumn's
constexpr std::string_view type_of_bytes = "bytes";

using Block = std::vector<char>;

Block compressed(const void* data, std::size_t bytes)
{
    Block block(ZSTD_compressBound(bytes));
    const std::size_t size = ZSTD_compress(block.data(), block.size(), data, bytes, level);
    if (ZSTD_isError(size)) throw Error(ZSTD_getErrorName(size));
    block.resize(size);
    return block;
}

[[noreturn]] void damaged(const char* how) { throw Error(fmt::format("{}; it is no whole snapshot", how)); }

void decompress(std::span<const unsigned char> block, void* data, std::size_t bytes)
{
    const std::size_t size = ZSTD_decompress(data, bytes, block.data(), block.size());
    if (ZSTD_isError(size) || size != bytes) damaged("a block does not fit its header");
}

// A block's size, before memory is taken for it.
std::size_t values_of(std::span<const unsigned char> block, std::uint64_t values, std::size_t bytes_a_value)
{
    const unsigned long long bytes = ZSTD_getFrameContentSize(block.data(), block.size());
    if (values > (std::uint64_t{1} << 48) || bytes != values * bytes_a_value)
        damaged("a block does not fit its header");
    return static_cast<std::size_t>(values);
}

std::uint64_t number_at(const unsigned char* at)
{
    std::uint64_t number;
    std::memcpy(&number, at, sizeof number);
    return number;
}

}  // namespace

void write_state(OutputFile& file, ordered_json header, const SavedState& state)
{
    std::vector<Block> blocks(1 + state.columns.size());
    tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t k) {
        if (k == 0)
            blocks[k] = compressed(state.bytes.data(), state.bytes.size());
        else
            std::visit([&](const auto& column) { blocks[k] = compressed(column.read().data, column.bytes()); },
                       state.columns[k - 1]);
    });
    header["format"] = format;
    ordered_json& list = header["blocks"] = ordered_json::array();
    list.push_back({{"type", type_of_bytes}, {"values", state.bytes.size()}, {"bytes", blocks[0].size()}});
    for (std::size_t k = 0; k < state.columns.size(); ++k)
        list.push_back({{"type", types[state.columns[k].index()]},
                        {"values", std::visit([](const auto& column) { return column.size(); }, state.columns[k])},
                        {"bytes", blocks[k + 1].size()}});

    const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> sum(XXH3_createState(), XXH3_freeState);
    if (!sum) throw std::bad_alloc();
    XXH3_64bits_reset(sum.get());
    const auto append = [&](const void* data, std::size_t bytes) {
        XXH3_64bits_update(sum.get(), data, bytes);
        file.append(data, bytes);
    };
    const std::string text = header.dump(1, ' ', false, ordered_json::error_handler_t::replace);
    const std::uint64_t length = text.size();
    append(magic.data(), magic.size());
    append(&length, sizeof length);
    append(text.data(), text.size());
    for (const Block& block : blocks) append(block.data(), block.size());
    const std::uint64_t digest = XXH3_64bits_digest(sum.get());
    file.append(&digest, sizeof digest);
}

bool StateFile::is_one(const std::filesystem::path& path)
{
    std::ifstream file(path, std::ios::binary);
    std::array<char, magic.size()> head{};
    return file.read(head.data(), head.size()) && std::string_view(head.data(), head.size()) == magic;
}

StateFile::StateFile(const std::filesystem::path& path) : file_(path)
{
    const std::span<const unsigned char> bytes = file_.bytes();
    constexpr std::size_t ends = magic.size() + 2 * sizeof(std::uint64_t);
    if (bytes.size() < ends || file_.text().substr(0, magic.size()) != magic) damaged("it does not begin as one");
    const std::size_t body = bytes.size() - sizeof(std::uint64_t);
    if (XXH3_64bits(bytes.data(), body) != number_at(bytes.data() + body)) damaged("its checksum is wrong");
    const std::uint64_t length = number_at(bytes.data() + magic.size());
    const std::size_t begin = magic.size() + sizeof length;
    if (length > body - begin) damaged("its header is longer than the file");
    blocks_at_ = begin + static_cast<std::size_t>(length);
    try {
        header_ = ordered_json::parse(file_.text().substr(begin, static_cast<std::size_t>(length)));
        if (header_.at("format").get<int>() != format)
            throw Error(fmt::format("it has the format {} of snapshots; this Rapid reads {}",
                                    header_.at("format").get<int>(), format));
    } catch (const nlohmann::json::exception&) {
        damaged("its header can't be read");
    }
}

SavedState StateFile::state() const
{
    struct Place {
        std::string type;
        std::uint64_t values;
        std::span<const unsigned char> block;
    };
    std::vector<Place> places;
    try {
        std::size_t at = blocks_at_;
        const std::size_t end = file_.bytes().size() - sizeof(std::uint64_t);
        for (const ordered_json& block : header_.at("blocks")) {
            const std::uint64_t size = block.at("bytes").get<std::uint64_t>();
            if (size > end - at) damaged("it is shorter than its header says");
            places.push_back({block.at("type"), block.at("values"), file_.bytes().subspan(at, size)});
            at += static_cast<std::size_t>(size);
        }
    } catch (const nlohmann::json::exception&) {
        damaged("its header can't be read");
    }
    if (places.empty() || places[0].type != type_of_bytes) damaged("its header can't be read");

    SavedState state;
    state.columns.assign(places.size() - 1, Column<float>());
    tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t k) {
        const auto& [type, values, block] = places[k];
        if (k == 0) {
            state.bytes.resize(values_of(block, values, 1));
            return decompress(block, state.bytes.data(), state.bytes.size());
        }
        const auto fill = [&, &values = values, &block = block]<class T>(const Column<T>&) {
            Column<T> column;
            const std::span<T> to = column.append_for_writing(values_of(block, values, sizeof(T)));
            decompress(block, to.data(), to.size_bytes());
            state.columns[k - 1] = std::move(column);
        };
        const KeptColumn of_type[] = {Column<float>(),        Column<Vec3f>(), Column<std::int32_t>(),
                                      Column<std::int64_t>(), Column<Quatf>(), Column<std::uint8_t>()};
        const auto found = std::find(types.begin(), types.end(), type);
        if (found == types.end()) damaged("its header can't be read");
        std::visit(fill, of_type[found - types.begin()]);
    });
    return state;
}

}  // namespace rapid

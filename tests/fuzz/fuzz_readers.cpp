// A target of libFuzzer for each of Rapid's own readers: RAPID_FUZZ_READER names one; without it the first byte of an
// input chooses. tests/fuzz/run builds and runs it.
//
// Lengths and checksums that would be wrong after every change are put in here.
#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

#include "bindings/command/farm_job.h"
#include "bindings/run/part_record.h"
#include "runtime/error.h"
#include "runtime/files/content_hash.h"
#include "runtime/files/frame_archive.h"
#include "runtime/io/format.h"
#include "runtime/io/state_file.h"
#include "runtime/points/state_archive.h"
#include "runtime/shapes/mesh/gltf_attributes.h"
#include "runtime/shapes/mesh/mesh_file.h"

namespace {

// A file without a name: the readers take a path.
const std::string& path_of(std::string_view text)
{
    static const int file = ::memfd_create("input", 0);
    static const std::string path = "/proc/self/fd/" + std::to_string(file);
    if (::ftruncate(file, 0) != 0 || ::pwrite(file, text.data(), text.size(), 0) != static_cast<ssize_t>(text.size()))
        std::abort();
    return path;
}

std::string number(std::uint64_t value)
{
    std::string bytes(sizeof value, '\0');
    std::memcpy(bytes.data(), &value, sizeof value);
    return bytes;
}

// What has its length, of two bytes, before it.
std::string_view take_stretch(std::string_view& input)
{
    std::size_t length = 0;
    for (int k = 0; k < 2 && !input.empty(); ++k, input.remove_prefix(1))
        length = length << 8 | static_cast<unsigned char>(input.front());
    const std::string_view stretch = input.substr(0, length);
    input.remove_prefix(stretch.size());
    return stretch;
}

// Of a header and the blocks.
std::string state_file(std::string_view input)
{
    const std::string_view header = take_stretch(input);
    std::string file = "\x89RAPID\r\n" + number(header.size());
    file.append(header).append(input);
    return file + number(rapid::content_hash(file));
}

std::string record_log(std::string_view input)
{
    std::string file;
    while (!input.empty()) {
        const std::string_view record = take_stretch(input);
        file.append(number(record.size()) + number(rapid::content_hash(record))).append(record);
    }
    return file;
}

// A .glb of a document and its buffer.
std::string binary_gltf(std::string_view input)
{
    const auto word = [](std::size_t value) { return number(value).substr(0, 4); };
    const std::string_view document = take_stretch(input);
    const std::string chunks = word(document.size()) + "JSON" + std::string(document) + word(input.size()) +
                               std::string("BIN\0", 4) + std::string(input);
    return "glTF" + word(2) + word(12 + chunks.size()) + chunks;
}

// The points of a format, by the name of a file.
template <std::size_t size>
struct Name {
    constexpr Name(const char (&text)[size])
    {
        for (std::size_t k = 0; k < size; ++k) name[k] = text[k];
    }
    char name[size];
};
template <Name file>
void read_points(std::string_view input)
{
    rapid::format_of(file.name).read(path_of(input));
}

void read_state(std::string_view input)
{
    rapid::PointSet points;
    rapid::restore(points, rapid::StateFile(path_of(state_file(input))).state());
}

void read_log(std::string_view input)
{
    // A log follows no link, which the path of a file without a name is.
    const std::string path = std::filesystem::temp_directory_path() / ("rapid-fuzz-log-" + std::to_string(::getpid()));
    std::ofstream(path, std::ios::binary) << record_log(input);
    const rapid::RecordLog log(path);
    std::filesystem::remove(path);
    std::uint64_t place = 0;
    for (std::string record; log.read(place, record);) {
    }
}

struct Reader {
    std::string_view name;
    void (*read)(std::string_view input);
};

// The files of the corpus begin with their places here: new ones come last.
constexpr Reader readers[] = {
    {"csv", read_points<"a.csv">},
    {"bgeo", read_points<"a.bgeo">},
    {"ply", read_points<"a.ply">},
    {"ply_mesh", [](std::string_view input) { rapid::read_ply_mesh(path_of(input)); }},
    {"npz", read_points<"a.npz">},
    {"prt", read_points<"a.prt">},
    {"usda", read_points<"a.usda">},
    {"vtp", read_points<"a.vtp">},
    {"obj", read_points<"a.obj">},
    {"state", read_state},
    {"log", read_log},
    {"part", [](std::string_view input) { rapid::PartRecord::read(path_of(input)); }},
    {"farm", [](std::string_view input) { rapid::SubmittedJob::read(path_of(input)); }},
    {"gltf", [](std::string_view input) { rapid::read_gltf_attributes(path_of(input)); }},
    {"glb", [](std::string_view input) { rapid::read_gltf_attributes(path_of(binary_gltf(input))); }},
};

const Reader* chosen()
{
    const char* const name = std::getenv("RAPID_FUZZ_READER");
    for (const Reader& reader : readers)
        if (name && reader.name == name) return &reader;
    if (name) std::abort();
    return nullptr;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    static const Reader* const only = chosen();
    if (size == 0) return 0;
    const Reader& reader = only ? *only : readers[data[0] % std::size(readers)];
    try {
        reader.read({reinterpret_cast<const char*>(data) + 1, size - 1});
    } catch (const rapid::Error&) {
    }
    return 0;
}

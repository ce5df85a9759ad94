// A libFuzzer target for each of Rapid's own readers: those of the registered point formats, and those below.
// RAPID_FUZZ_READER selects one; without it the names are printed. tests/fuzz/run builds and runs this program.
//
// Correct lengths and checksums are inserted here, because mutations would almost always break them.
#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "bindings/command/farm_job.h"
#include "bindings/run/part_record.h"
#include "runtime/base/error.h"
#include "runtime/files/content_hash.h"
#include "runtime/files/frame_archive.h"
#include "runtime/io/format.h"
#include "runtime/io/state_file.h"
#include "runtime/points/state_archive.h"
#include "runtime/shapes/mesh/mesh_file.h"

namespace {

// Returns the path of an unnamed file with this content, because readers take a path.
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

// Takes the next part, which is preceded by its length in two bytes.
std::string_view take_stretch(std::string_view& input)
{
    std::size_t length = 0;
    for (int k = 0; k < 2 && !input.empty(); ++k, input.remove_prefix(1))
        length = length << 8 | static_cast<unsigned char>(input.front());
    const std::string_view stretch = input.substr(0, length);
    input.remove_prefix(stretch.size());
    return stretch;
}

// Builds a state file from a header and blocks.
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

// Builds a .glb file from a document and its buffer.
std::string binary_gltf(std::string_view input)
{
    const auto word = [](std::size_t value) { return number(value).substr(0, 4); };
    const std::string_view document = take_stretch(input);
    const std::string chunks = word(document.size()) + "JSON" + std::string(document) + word(input.size()) +
                               std::string("BIN\0", 4) + std::string(input);
    return "glTF" + word(2) + word(12 + chunks.size()) + chunks;
}

void read_state(std::string_view input)
{
    rapid::PointSet points;
    rapid::restore(points, rapid::StateFile(path_of(state_file(input))).state());
}

void read_log(std::string_view input)
{
    // A log is not read through a symbolic link, so it needs a named file.
    const std::string path = std::filesystem::temp_directory_path() / ("rapid-fuzz-log-" + std::to_string(::getpid()));
    std::ofstream(path, std::ios::binary) << record_log(input);
    const rapid::RecordLog log(path);
    std::filesystem::remove(path);
    std::uint64_t place = 0;
    for (std::string record; log.read(place, record);) {
    }
}

using Reader = std::function<void(std::string_view input)>;

std::map<std::string, Reader> readers()
{
    std::map<std::string, Reader> all = {
        {"farm", [](std::string_view input) { rapid::SubmittedJob::read(path_of(input)); }},
        {"glb", [](std::string_view input) { rapid::read_gltf_mesh(path_of(binary_gltf(input))); }},
        {"gltf", [](std::string_view input) { rapid::read_gltf_mesh(path_of(input)); }},
        {"log", read_log},
        {"part", [](std::string_view input) { rapid::PartRecord::read(path_of(input)); }},
        {"obj_mesh", [](std::string_view input) { rapid::read_obj_mesh(path_of(input)); }},
        {"ply_mesh", [](std::string_view input) { rapid::read_ply_mesh(path_of(input)); }},
        {"state", read_state},
        {"stl", [](std::string_view input) { rapid::read_stl_mesh(path_of(input)); }},
    };
    for (const rapid::Format& format : rapid::formats())
        if (format.read)
            all[format.extension.substr(1)] = [read = format.read](std::string_view input) { read(path_of(input)); };
    for (const auto& [extension, read] : rapid::point_readers())
        all[extension.substr(1)] = [read = read](std::string_view input) { read(path_of(input)); };
    return all;
}

// Writes files of a format, with two points and with none, as the fuzzer's first inputs.
void write_seeds(const std::string& extension)
{
    rapid::PointSet points;
    rapid::write_points("corpus/none." + extension, points);
    points.append(2);
    points.id().write()[1] = 7;
    points.add({"heat", 0.5f});
    points.add({"kind", std::int32_t{3}});
    points.add({"orient", rapid::Quatf::Identity()});
    points.add({"name", rapid::token_of("a \"b\", c")});
    points.group("hot").write()[1] = 1;
    points.P().write()[1] = {1, 2.5f, 3e-7f};
    rapid::write_points("corpus/two." + extension, points);
}

Reader reader;

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***)
{
    const char* const name = std::getenv("RAPID_FUZZ_READER");
    for (const auto& [known, read] : readers())
        if (!name)
            std::puts(known.c_str());
        else if (name == known)
            reader = read;
    if (!name) std::exit(0);
    if (!reader) std::abort();
    for (const rapid::Format& format : rapid::formats())
        if (format.extension.substr(1) == name) write_seeds(name);
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    try {
        reader({reinterpret_cast<const char*>(data), size});
    } catch (const rapid::Error&) {
    }
    return 0;
}

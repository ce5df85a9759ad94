#include "runtime/shapes/mesh/text_end.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <string>
#include <string_view>

#include "runtime/error.h"
#include "runtime/files/input_file.h"

namespace rapid {
namespace {

// Returns up to `most` bytes from a position of the file.
std::string read_at(std::ifstream& file, std::size_t position, std::size_t most)
{
    std::string bytes(most, '\0');
    file.seekg(static_cast<std::streamoff>(position));
    file.read(bytes.data(), static_cast<std::streamsize>(most));
    bytes.resize(static_cast<std::size_t>(file.gcount()));
    return bytes;
}

// Returns the last line that is not white space, or its end if it is longer than the text.
std::string last_line(std::string_view end_of_text)
{
    const std::string_view text = end_of_text.substr(0, end_of_text.find_last_not_of(" \t\r\n") + 1);
    return std::string(text.substr(text.find_last_of("\r\n") + 1));
}

bool is_text_stl(std::ifstream& file, std::size_t size)
{
    constexpr std::size_t header = 80, facet = 50;
    const std::string head = read_at(file, 0, header + sizeof(std::uint32_t));
    std::uint32_t facets = 0;
    if (head.size() == header + sizeof facets) {
        std::memcpy(&facets, head.data() + header, sizeof facets);
        if (size == head.size() + std::uint64_t{facet} * facets) return false;
    }
    return std::string_view(head).substr(std::min(head.find_first_not_of(" \t"), head.size())).starts_with("solid");
}

}  // namespace

void check_text_end(const std::filesystem::path& path)
{
    const std::size_t size = check_readable(path);
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (extension != ".stl") return;
    std::ifstream file(path, std::ios::binary);
    constexpr std::size_t most = 4096;
    const std::string end = read_at(file, size - std::min(size, most), std::min(size, most));
    if (is_text_stl(file, size) && !last_line(end).starts_with("endsolid"))
        throw Error("the file ends early: its last line is not \"endsolid\"");
}

}  // namespace rapid

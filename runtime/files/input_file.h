// A whole file read into memory, and expanded if gzip compressed it. Unlike a mapped file, it stays intact if another
// process truncates it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

namespace rapid {

// Files that a command writes in addition to frames, such as reports.

// Writes a file completely or not at all. Throws Error, with the file's name, if the file system does.
void write_whole(const std::filesystem::path& path, std::string_view bytes);

class InputFile {
public:
    // Throws Error if the file does not exist or is not a regular file (reading from a pipe might never end).
    explicit InputFile(const std::filesystem::path& path);

    std::span<const unsigned char> bytes() const { return {bytes_.get(), size_}; }
    // Returns the contents without the UTF-8 byte order mark that editors and spreadsheets may add.
    std::string_view text() const;

private:
    void expand();

    std::unique_ptr<unsigned char[]> bytes_;
    std::size_t size_ = 0;
};

// Returns the name of a compressed file without its last extension: cloud.bgeo of cloud.bgeo.gz.
std::filesystem::path without_gz(const std::filesystem::path& path);

// Returns the size of a file, for a library that opens files itself. Throws Error like the constructor of InputFile.
std::size_t check_readable(const std::filesystem::path& path);

}  // namespace rapid

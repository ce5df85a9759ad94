// A whole file, read into memory: unlike a mapped one it stays as it is when another process truncates it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

namespace rapid {

class InputFile {
public:
    // Error: no such file; no regular file (reading from a pipe might never end).
    explicit InputFile(const std::filesystem::path& path);

    std::span<const unsigned char> bytes() const { return {bytes_.get(), size_}; }
    // Without the mark of UTF-8's byte order that editors and spreadsheets may begin a file with.
    std::string_view text() const;

private:
    std::unique_ptr<unsigned char[]> bytes_;
    std::size_t size_ = 0;
};

// For a library that opens files by itself: its size. Error: as the constructor of InputFile.
std::size_t check_readable(const std::filesystem::path& path);

}  // namespace rapid

// Files for the formats: one that several threads write, one that is mapped into memory, and one that gets its name
// only when it is complete.
//
// Errors have the system's reason but not the file name, because a frame is first written under a temporary name: the
// caller adds the final one (Error::at).
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "runtime/error.h"

namespace rapid {

// `can't be written: No space left on device`, and the like.
Error file_error(const std::string& what, int system_error);

// A file open for writing. write_at() may be called from any thread; the file ends where the furthest write does.
class OutputFile {
public:
    // Creates or truncates the file.
    explicit OutputFile(const std::filesystem::path& path);
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;
    ~OutputFile();

    void write_at(std::uint64_t offset, const void* data, std::size_t bytes);
    // Writes after the bytes appended so far; from one thread.
    void append(const void* data, std::size_t bytes);
    std::uint64_t appended() const { return appended_; }

    // Reports errors that only closing finds (on network file systems, a full disk).
    void close();

private:
    int descriptor_ = -1;
    std::uint64_t appended_ = 0;
};

// A whole file, mapped into memory.
class InputFile {
public:
    explicit InputFile(const std::filesystem::path& path);
    InputFile(const InputFile&) = delete;
    InputFile& operator=(const InputFile&) = delete;
    ~InputFile();

    std::span<const unsigned char> bytes() const { return {data_, size_}; }
    std::string_view text() const { return {reinterpret_cast<const char*>(data_), size_}; }

private:
    const unsigned char* data_ = nullptr;
    std::size_t size_ = 0;
};

// A file that is written under a hidden name in its final folder, and renamed when it is complete. Missing folders are
// made. Unfinished files are removed by the destructor, or by remove_unfinished_files().
class UnfinishedFile {
public:
    explicit UnfinishedFile(const std::filesystem::path& final_path);
    UnfinishedFile(const UnfinishedFile&) = delete;
    UnfinishedFile& operator=(const UnfinishedFile&) = delete;
    ~UnfinishedFile();

    const std::filesystem::path& path() const { return path_; }
    void finish();

    struct Entry;  // of the list for remove_unfinished_files()

private:
    std::filesystem::path final_path_, path_;
    Entry* entry_;
};

// Removes all unfinished files and prevents further ones: for a signal handler or a watchdog that ends the process
// next. Async-signal-safe.
void remove_unfinished_files() noexcept;

}  // namespace rapid

// Files as the formats need them: one that is written from several threads, one that is read as memory, and one that
// has its name only when it is complete.
//
// Errors say the system's reason and not the file: who knows the final name adds it (Error::at), because a frame is
// written under a hidden name first.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "runtime/error.h"

namespace rapid {

// `can't be written: No space left on device`, and the like.
Error file_error(const std::string& what, int system_error);

// A file open for writing. Writes at given places may come from any thread; the file is as large as the furthest.
class OutputFile {
public:
    // Makes or empties the file.
    explicit OutputFile(const std::filesystem::path& path);
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;
    ~OutputFile();

    void write_at(std::uint64_t offset, const void* data, std::size_t bytes);
    // Behind what append() has written so far; from one thread.
    void append(const void* data, std::size_t bytes);
    std::uint64_t appended() const { return appended_; }

    // Reports what only closing can find (network file systems say there that a disk is full).
    void close();

private:
    int descriptor_ = -1;
    std::uint64_t appended_ = 0;
};

// A whole file as memory.
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

// A file that is written under a hidden name in the folder of its final one, and renamed when it is complete. Missing
// folders are made. What is not finished is removed: by the destructor, or by remove_unfinished_files().
class UnfinishedFile {
public:
    explicit UnfinishedFile(const std::filesystem::path& final_path);
    UnfinishedFile(const UnfinishedFile&) = delete;
    UnfinishedFile& operator=(const UnfinishedFile&) = delete;
    ~UnfinishedFile();

    const std::filesystem::path& path() const { return path_; }
    void finish();

    struct Entry;  // a place in the list that remove_unfinished_files() walks

private:
    std::filesystem::path final_path_, path_;
    Entry* entry_;
};

// Removes all unfinished files and lets no further one be made: for a signal handler or a watchdog that ends the
// process next. Async-signal-safe.
void remove_unfinished_files() noexcept;

}  // namespace rapid

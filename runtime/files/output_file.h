// The way in which all files are written: a file gets its name when it is complete, and not before.
//
// Where the file system has files without names (O_TMPFILE), an unfinished one is gone with its process, however that
// ends. Elsewhere, and for the moment in which a file replaces another, it is called `.rapid-RANDOM.unfinished`, in its
// final folder; a lock (flock) says that its process lives. The first file that a later process writes into the folder
// removes those that nobody holds. Names are random, and made with O_EXCL: no process meets another's, and a link of
// that name is not followed.
//
// Errors name the system's reason, not the file (file_error.h).
#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>

#include "runtime/files/file_error.h"

namespace rapid {

class OutputFile {
public:
    // What an unfinished file is. Hidden is for file systems that have no others.
    enum class Unfinished { Unnamed, Hidden };

    // Missing folders are made. Error: what has that name is not a regular file.
    explicit OutputFile(const std::filesystem::path& path, Unfinished unfinished = Unfinished::Unnamed);
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;
    // Of a file that is not finished nothing stays.
    ~OutputFile();

    // From any thread; the file ends where the furthest write does.
    void write_at(std::uint64_t offset, const void* data, std::size_t bytes);
    // Writes after the bytes appended so far; from one thread.
    void append(const void* data, std::size_t bytes);
    std::uint64_t appended() const { return appended_; }
    // For another program that writes the file.
    int descriptor() const { return descriptor_.number(); }

    // Names the file, in place of any other of that name. Error: whatever the file system kept back until now.
    void finish();
    // As finish(), unless the name is taken: then it returns false.
    bool finish_unless_taken();

private:
    class HiddenName;

    void open_unnamed();
    void open_hidden();
    void complete();
    void lock();
    bool link_to(const std::filesystem::path& name);
    void link_to_hidden();
    void keep_name();

    std::filesystem::path path_, folder_;
    Descriptor descriptor_;
    std::unique_ptr<HiddenName> hidden_;
    std::uint64_t appended_ = 0;
};

// Whether this process wrote the file, among the last that it wrote, and it is as it was.
bool is_own_file(const std::filesystem::path& path);

// From now on a file is on the disk when finish() returns (fsync), so that it outlasts a power cut.
void make_files_durable();

// Another program that writes an unfinished file, and that remove_unfinished_files() ends. For as long as it lives the
// program is not waited for. Of more than 16 the others end by themselves.
class WritingProgram {
public:
    explicit WritingProgram(pid_t program);
    ~WritingProgram();
    WritingProgram(const WritingProgram&) = delete;
    WritingProgram& operator=(const WritingProgram&) = delete;

private:
    std::atomic<pid_t>* place_ = nullptr;
};

// Removes all unfinished files, ends the programs that write them, and prevents further ones: for a signal handler or a
// watchdog that ends the process next. Async-signal-safe.
void remove_unfinished_files() noexcept;

}  // namespace rapid

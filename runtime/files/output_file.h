// The way in which all files are written: a file gets its name only when it is complete.
//
// If the file system supports unnamed files (O_TMPFILE), an unfinished file disappears with its process, however that
// ends. Otherwise, and while one file replaces another, its name is `.rapid-RANDOM.unfinished`, in its final folder. A
// lock (flock) shows that its process is alive. The first file that a later process writes into the folder removes
// those that are not locked. Names are random and created with O_EXCL, so processes never share one, and a link with
// that name is not followed.
//
// Errors give the system's reason but not the file's name (file_error.h).
#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <ostream>
#include <streambuf>
#include <vector>

#include "runtime/files/file_error.h"

namespace rapid {

class OutputFile {
public:
    // The kind of unfinished file. Hidden is for file systems without unnamed files.
    enum class Unfinished { Unnamed, Hidden };

    // Creates missing folders. Throws Error if the path exists and is not a regular file.
    explicit OutputFile(const std::filesystem::path& path, Unfinished unfinished = Unfinished::Unnamed);
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;
    // Discards the file unless it is finished.
    ~OutputFile();

    // Thread-safe. The file ends at the end of the furthest write.
    void write_at(std::uint64_t offset, const void* data, std::size_t bytes);
    // Writes after the bytes appended so far. Single-threaded.
    void append(const void* data, std::size_t bytes);
    std::uint64_t appended() const { return appended_; }
    // Returns the descriptor, for another program that writes the file.
    int descriptor() const { return descriptor_.number(); }

    // Names the file and replaces any other file of that name. Throws Error if the file system reports a delayed
    // failure.
    void finish();
    // Like finish(), but returns false if the name is taken.
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

// Returns true if the file is unchanged and among the last that this process wrote.
bool is_own_file(const std::filesystem::path& path);

// Makes finish() return only when the file is on the disk (fsync), so that it survives a power cut.
void make_files_durable();

// Another program that writes an unfinished file and that remove_unfinished_files() kills. Must be destroyed before the
// program is waited for. Beyond 16 programs, further ones are not tracked and end by themselves.
class WritingProgram {
public:
    explicit WritingProgram(pid_t program);
    ~WritingProgram();
    WritingProgram(const WritingProgram&) = delete;
    WritingProgram& operator=(const WritingProgram&) = delete;

private:
    std::atomic<pid_t>* slot_ = nullptr;
};

// Removes all unfinished files, kills the programs that write them, and prevents new ones. For a signal handler or a
// watchdog that ends the process next. Async-signal-safe.
void remove_unfinished_files() noexcept;

// A file as a stream, for libraries that write to one without checking for failure. The stream throws the file's own
// errors.
class OutputBuffer : public std::streambuf {
public:
    explicit OutputBuffer(OutputFile& file);

    void flush();

protected:
    int_type overflow(int_type c) override;
    int sync() override;
    pos_type seekoff(off_type offset, std::ios_base::seekdir direction, std::ios_base::openmode) override;
    pos_type seekpos(pos_type position, std::ios_base::openmode mode) override;

private:
    OutputFile& file_;
    std::vector<char> block_;
    std::uint64_t offset_ = 0;  // of the block in the file
    std::uint64_t end_ = 0;
};

// The caller must call flush() at the end, because a destructor can't report a full disk.
class OutputStream : public std::ostream {
public:
    explicit OutputStream(OutputFile& file) : std::ostream(nullptr), buffer_(file)
    {
        rdbuf(&buffer_);
        exceptions(badbit | failbit);  // rethrows the buffer's own error
    }

private:
    OutputBuffer buffer_;
};

}  // namespace rapid

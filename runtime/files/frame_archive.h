// Folders in which runs store frames for later runs: `--cache` of `rapid run` and of the viewer.
//
// A folder has files by kind and frame, such as snapshot.0010.rapid, and a journal with a record for each frame. A file
// gets its name when it is complete, and each record of the journal has a checksum. A run that is killed at any moment
// therefore leaves frames that are complete or absent.
//
//   "\x89RAPIDJ\n"                                  the journal's first bytes
//   8 bytes, 8 bytes, the record; and so on         the length of the record, and its XXH3
#pragma once

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "runtime/files/file_error.h"

namespace rapid {

// A file that grows by records, each with its length and checksum.
class RecordLog {
public:
    // Opens a file and keeps its contents, or creates it. The first record is written at the beginning. Throws Error if
    // the file can't be opened or is a link.
    explicit RecordLog(const std::filesystem::path& path);
    // Creates a log in memory. Processes that fork from this one share it. It disappears when the last of them ends.
    static RecordLog in_memory();

    // Throws Error if the record can't be written; the log is then unchanged.
    void append(std::string_view record);
    // Reads the record at `position` and moves `position` to the next one. Returns false if there is no complete
    // record.
    bool read(std::uint64_t& position, std::string& record) const;

    // Returns the position of the next record.
    std::uint64_t end() const { return end_; }
    // Continues at `position`. Records after it stay until new ones replace them: a run that resumes from an early
    // snapshot writes the same records again, and a later snapshot may refer to them.
    void continue_at(std::uint64_t position) { end_ = position; }
    void clear();

private:
    explicit RecordLog(Descriptor file) : file_(std::move(file)) {}
    std::uint64_t size() const;

    Descriptor file_;
    std::uint64_t end_ = 0;
};

class FrameArchive {
public:
    explicit FrameArchive(std::filesystem::path folder) : folder_(std::move(folder)) {}
    // Waits until all files are written.
    ~FrameArchive();
    FrameArchive(const FrameArchive&) = delete;
    FrameArchive& operator=(const FrameArchive&) = delete;

    // Creates the folder and locks it for this process. shown_as, who: the folder and its user in error messages.
    // Throws Error if another process keeps the lock for five seconds; a killed process holds it until its memory is
    // freed.
    static Descriptor lock(const std::filesystem::path& folder, const std::filesystem::path& shown_as, const char* who);

    const std::filesystem::path& folder() const { return folder_; }
    std::filesystem::path file(std::string_view kind, std::int64_t frame) const;
    // Returns the files of one kind by frame.
    std::map<std::int64_t, std::filesystem::path> files(std::string_view kind) const;

    // Writes a file on a thread of the archive. Blocks while another file waits to be written. `write` throws if the
    // file can't be written. Its captures are released when it is done. Thread-safe, as are the next two.
    using Write = std::function<void(const std::filesystem::path& path)>;
    void submit(std::string_view kind, std::int64_t frame, Write write);
    // Waits until all files are written.
    void finish();
    // Returns the reasons why files and the journal could not be written since the last call.
    std::vector<std::string> take_failures();

    std::filesystem::path journal() const { return folder_ / "journal"; }
    struct Records {
        std::vector<std::string> whole;
        std::size_t damaged = 0;
    };
    // Returns nothing if there is no journal. Throws Error with its name if it can't be read.
    std::optional<Records> read_journal() const;
    // Replaces the journal. If it can't be written, take_failures() says why, and add() does nothing.
    void begin_journal(const std::vector<std::string>& records);
    // Throws Error if the record can't be written; the journal is then unchanged.
    void add(std::string_view record);

private:
    struct Job {
        std::filesystem::path path;
        Write write;
    };
    void write_files();

    const std::filesystem::path folder_;
    std::optional<RecordLog> journal_;

    std::mutex mutex_;  // guards the members below
    std::condition_variable changed_;
    std::optional<Job> waiting_;
    bool is_busy_ = false, is_stopping_ = false;
    std::vector<std::string> failures_;
    std::thread writer_;  // starts with the first file
};

}  // namespace rapid

// `--cache DIR`: snapshots of a run and a journal of its frames, from which a later run continues.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bindings/run/event_file.h"
#include "bindings/run/frame_files.h"
#include "bindings/run/frame_record.h"
#include "include/rapid/run.h"
#include "runtime/files/frame_archive.h"
#include "runtime/graph/evaluate.h"

namespace rapid {

class RunCache {
public:
    // estimates_errors: applies if the cache begins with this run.
    RunCache(const RunCacheOptions& options, bool estimates_errors)
        : archive_(options.folder),
          every_(options.every),
          again_(options.again),
          replaces_(options.replace),
          estimates_errors_(estimates_errors)
    {
    }

    bool requested() const { return !archive_.folder().empty(); }
    bool keeps_snapshots() const { return requested() && every_ > 0; }
    const std::filesystem::path& folder() const { return archive_.folder(); }

    // Reports a file that the graph reads, before it is read.
    void was_read(const std::filesystem::path& file);
    void set_graph(const std::filesystem::path& graph);

    // Compares the request with the folder's contents. options: for the fingerprint. Throws Error if another run uses
    // the folder, or if its fingerprint differs.
    void begin(const Session& session, const Plan& plan, const RunFrames& frames, const Fingerprint& options,
               FrameFiles& files, EventFile& events);

    // Returns true if this run estimates errors; valid after begin(). Either all runs of a cache do or none, as decided
    // by its first one: estimates accumulate from frame to frame.
    bool estimates_errors() const { return estimates_errors_; }

    // Return the frames to compute; nothing if all requested ones exist.
    std::optional<std::int64_t> first_due() const { return first_due_; }
    std::int64_t last_due() const { return last_due_; }
    // Advances an evaluator as near to the first frame as a snapshot allows.
    void restore(Evaluator& evaluator, EventFile& events);
    // Returns the records of frames that are not computed, in order.
    std::vector<const FrameRecord*> records(std::int64_t first, std::int64_t last) const;

    // Report computed frames, as in RunReport. complete_before: all files of earlier frames are complete; without a
    // value, all files are. The seconds and the peak are those of the run so far.
    void warned(const std::string& text) { warnings_.push_back(text); }
    void computed(const FrameFigures& frame);
    void written(const FrameFiles::Written& file);
    void complete_before(std::optional<std::int64_t> frame, double seconds, std::uint64_t peak_bytes);

    // Takes a snapshot after a frame, if one is due or in_any_case.
    void keep(const Evaluator& evaluator, EventFile& events, bool in_any_case);
    // Returns the frame of the last submitted snapshot.
    std::optional<std::int64_t> last_kept() const { return last_kept_; }
    // Waits for the snapshots. complete: films are complete, too.
    void finish(bool complete);
    // Returns warnings for the user since the last call.
    std::vector<std::string> take_warnings();

private:
    // The folder's contents for the run.
    struct Known {
        Fingerprint fingerprint;
        std::map<std::int64_t, FrameRecord> frames;
        std::map<std::string, WrittenFile> films;  // by path
    };
    // Returns true if a fingerprint belongs to this run.
    bool is_of_run(const Fingerprint& other) const;
    void read_journal();
    // Throws Error if the record is damaged, or of another version.
    void read_record(const std::string& record, bool is_first);
    // Returns fingerprint_ with the estimate of errors of another run.
    Fingerprint with_errors_as_in(const Fingerprint& other) const;
    void refuse(const std::vector<std::string>& differences);
    void check_contents();
    void start_over();
    void continue_previous();
    // Finds the complete files of the frames, and the frames to compute.
    void find_due(const Plan& plan, FrameFiles& files);
    void leave_waiting_pictures(FrameFiles::WholeFiles& whole, const FrameFiles& files) const;
    std::filesystem::path events_log() const { return folder() / "events"; }
    bool load(std::int64_t frame, const std::filesystem::path& file, Evaluator& evaluator, EventFile& events);
    // Adds a record to the journal. If it cannot be written, warns with the consequence.
    void add(const std::string& record, const char* so);

    Descriptor lock_;  // held until the archive has written everything
    FrameArchive archive_;
    const std::int64_t every_;
    bool again_;
    const bool replaces_;
    bool estimates_errors_;
    std::filesystem::path graph_;

    std::unique_ptr<InputContents> read_;
    Fingerprint fingerprint_, contents_;  // contents_: of the files read in frames
    Known known_;
    RunFrames frames_{0, 0};
    std::int64_t first_frame_ = 0, last_due_ = 0;
    std::optional<std::int64_t> first_due_, last_kept_;
    std::map<std::int64_t, FrameRecord> open_;  // frames with files still to come
    std::map<std::string, WrittenFile> films_;  // by path, that are being written
    std::vector<std::string> warnings_, failures_;
};

}  // namespace rapid

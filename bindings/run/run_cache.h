// `--cache DIR`: snapshots of a run and a journal of its frames, from which it goes on where it was.
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
    // estimates_errors: if the cache begins with this run.
    RunCache(const RunCacheOptions& options, bool estimates_errors)
        : archive_(options.folder),
          every_(options.every),
          again_(options.again),
          replaces_(options.replace),
          estimates_errors_(estimates_errors)
    {
    }

    bool asked() const { return !archive_.folder().empty(); }
    bool keeps_snapshots() const { return asked() && every_ > 0; }
    const std::filesystem::path& folder() const { return archive_.folder(); }

    // A file that the graph reads, before it is read.
    void was_read(const std::filesystem::path& file);
    void set_graph(const std::filesystem::path& graph);

    // What is asked for, and what the folder has of it. options: of the fingerprint. Error: another run has the folder,
    // or it is of a run of another fingerprint.
    void begin(const Session& session, const Plan& plan, const RunFrames& frames, const Fingerprint& options,
               FrameFiles& files, EventFile& events);

    // After begin(): whether this run estimates errors. All runs of a cache do, or none, as its first one has decided:
    // estimates accumulate from frame to frame.
    bool estimates_errors() const { return estimates_errors_; }

    // The frames that are to be computed; nothing: all that was asked for is there.
    std::optional<std::int64_t> first_due() const { return first_due_; }
    std::int64_t last_due() const { return last_due_; }
    // Takes an evaluator as near to the first frame as a snapshot does.
    void restore(Evaluator& evaluator, EventFile& events);
    // Of frames that are not computed, in order.
    std::vector<const FrameRecord*> records(std::int64_t first, std::int64_t last) const;

    // Of the frames that are computed, as RunReport hears of them. complete_before: frames of whose files none is to
    // come; all, where none is to come of any. The seconds and the peak are those of the run until now.
    void warned(const std::string& text) { warnings_.push_back(text); }
    void computed(const FrameStatistics& frame, const std::vector<Stiffness>& stiff);
    void written(const FrameFiles::Written& file);
    void complete_before(std::optional<std::int64_t> frame, double seconds, std::uint64_t peak_bytes);

    // After a frame: a snapshot, where one is due, or in any case.
    void keep(const Evaluator& evaluator, EventFile& events, bool in_any_case);
    // The frame of the last snapshot that was submitted.
    std::optional<std::int64_t> last_kept() const { return last_kept_; }
    // Waits for the snapshots. complete: films are, too.
    void finish(bool complete);
    // For the user, since the last call.
    std::vector<std::string> take_warnings();

private:
    // What the folder has of the run.
    struct Known {
        Fingerprint fingerprint;
        std::map<std::int64_t, FrameRecord> frames;
        std::map<std::string, WrittenFile> films;  // by path
    };
    // Whether a fingerprint is of this run.
    bool is_of_run(const Fingerprint& other) const;
    void read_journal();
    // Throws Error if the record is damaged, or of another version.
    void read_record(const std::string& record, bool is_first);
    // fingerprint_ with the estimate of errors of another run.
    Fingerprint with_errors_as_in(const Fingerprint& other) const;
    void refuse(const std::vector<std::string>& differences);
    void check_contents();
    void begin_anew();
    void go_on_as_before();
    // What is whole of the frames, and the frames that are not.
    void find_due(const Plan& plan, FrameFiles& files);
    void leave_waiting_pictures(FrameFiles::WholeFiles& whole, const FrameFiles& files) const;
    std::filesystem::path events_log() const { return folder() / "events"; }
    bool load(std::int64_t frame, const std::filesystem::path& file, Evaluator& evaluator, EventFile& events);
    // Adds a record to the journal. If it can't be written, that is a warning with what follows from it.
    void add(const std::string& record, const char* so);

    Descriptor lock_;  // until the archive has written all
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
    std::map<std::int64_t, FrameRecord> open_;  // frames whose files are to come
    std::map<std::string, WrittenFile> films_;  // by path, that are being written
    std::vector<std::string> warnings_, failures_;
};

}  // namespace rapid

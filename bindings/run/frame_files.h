// The output files of a run: those of -o, and of `:write` and `:rasterize` nodes. Each pattern has its own writer.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bindings/host/picture_scene.h"
#include "bindings/run/part_record.h"
#include "bindings/run/written_names.h"
#include "include/rapid/run.h"
#include "runtime/graph/evaluate.h"
#include "runtime/io/frame_writer.h"

namespace rapid {

struct Rasterize;

// Returns the folders of the files of -o, which are created if missing; for a pattern with a folder that depends on the
// output, the one above. Throws Error if one cannot be created, or if a text is not a -o.
std::vector<std::filesystem::path> folders_of(const std::vector<std::string>& outputs);

class FrameFiles {
public:
    // outputs: texts of -o. Throws Error if one is invalid.
    FrameFiles(const std::vector<std::string>& outputs, std::shared_ptr<const PictureOptions> picture);

    // Makes the files those of a part. Call it before all functions below. record: the identity known before the run;
    // it may grow until finish().
    void take_part(std::shared_ptr<const PartRecord> record);

    // Returns options of the plan, which must keep all attributes that -o names.
    PlanOptions plan_options(std::optional<std::uint64_t> seed) const;

    // Returns the results of `rapid merge` for the parts of a run: its -o, and the pattern of the parts. Call it after
    // resolve(). Throws Error for a picture, which cannot be merged, or a name with {part}.
    std::vector<std::pair<std::string, std::string>> merges() const;

    // Throws Error for an unknown format; a name that nothing makes; a pattern for one file that gets several frames,
    // or for no output of the graph; or two that write the same files.
    void resolve(const Plan& plan, bool several_frames);

    // Adds the names of all files. Call it after resolve(). Throws Error if another writer has the name, or if the file
    // is read.
    void claim(WrittenNames& names, const RunFrames& frames) const;
    // Does the same for the files of nodes, among processes (claim_among_processes).
    void claim(const std::filesystem::path& folder, const std::string& who) const;

    // The files of -o for a frame, and how they are made: two with the same path that are made alike are the same.
    struct FrameFile {
        std::string path, how;
        bool film = false;  // one file for all frames
    };
    std::vector<FrameFile> files_of(std::int64_t frame, const RunFrames& frames) const;

    // Complete files of an earlier run, which are not written again. By frame and absolute path; films by absolute
    // path.
    struct WholeFiles {
        struct File {
            std::string how;
            std::shared_ptr<const PictureFit> fit;  // of a picture
        };
        std::map<std::int64_t, std::map<std::string, File>> frames;
        std::map<std::string, std::string> films;  // with how they are made
    };
    void continue_after(WholeFiles whole, const RunFrames& frames);

    // Queues the files of a frame. Throws Error if one of an earlier frame could not be written.
    void write(const FrameResult& result);
    // Queues the file of a `:write` or `:rasterize` node.
    void write_node(const std::string& pattern, const PointSet& points, const Frame& frame, double fps);

    // Waits until all files are written. complete: all frames are there; otherwise films and records of a part are not
    // made. Throws Error if one could not be written.
    void finish(bool complete = true);

    // Returns the first name of each pattern and output, once.
    std::vector<std::string> take_first_names() { return std::exchange(first_names_, {}); }

    // Returns warnings about data that files do not hold, each once.
    std::vector<std::string> take_warnings() { return std::exchange(warnings_, {}); }

    // Return the files completed since the last call, and the first queued frame that has an unfinished file. Callable
    // from any thread.
    struct Written : FrameWriter::Written {
        std::string how;
        bool of_node;  // a `:write` or `:rasterize`
    };
    std::vector<Written> take_written();
    std::optional<std::int64_t> first_unwritten() const;

private:
    struct Target {
        OutputTarget to;
        std::string text;                  // as the user gave it
        std::vector<std::string> outputs;  // the outputs whose points it takes
    };
    void resolve(Target& target, const Plan& plan) const;
    void warn_of_strings(const OutputTarget& to, const PointSet& points);
    std::string name_in_part(const std::string& pattern) const;
    void check_part(const std::string& pattern) const;
    void note_frame(const std::string& pattern, const std::string& output, const FrameInfo& info, std::uint64_t points);
    void write_part_records() const;
    void check_film(const Format& format, const std::string& pattern) const;
    FrameInfo info_of(std::int64_t number, double time, double fps, const OutputTarget& to);
    std::string how_of(const OutputTarget& to, const RunFrames& frames) const;
    const WholeFiles::File* whole_file(std::int64_t frame, const std::string& path, const std::string& how) const;
    FrameWriter::Write write_of(const std::string& pattern) const;
    void submit(const OutputTarget& to, PointSet points, FrameInfo info, const std::string& output, bool of_node);

    std::vector<Target> targets_;
    struct Volume {
        const Rasterize* of;  // of the plan
        std::string node;
        Location location;
    };
    std::map<std::string, Volume> volumes_;  // by pattern
    struct NodePattern {
        std::string pattern, node;
        Location location;
    };
    std::vector<NodePattern> of_nodes_;
    std::map<std::string, std::set<std::string>> unrequested_;  // by output: Plan::unrequested_columns
    std::shared_ptr<const PictureOptions> picture_;
    std::unique_ptr<SceneOfPlan> scene_;

    std::shared_ptr<const PartRecord> part_;  // null if all points are simulated
    struct Sequence {
        std::string pattern, output;
        double fps;
        std::int64_t start;
        std::map<std::int64_t, std::uint64_t> points = {};  // numbers of points, by frame
    };
    std::map<std::filesystem::path, Sequence> of_part_;  // by the file of the record
    std::set<std::filesystem::path> begun_;              // likewise: those with a frame written

    std::set<std::string> named_;
    std::vector<std::string> first_names_;
    std::set<std::string> warned_;  // patterns and attributes
    std::vector<std::string> warnings_;

    mutable std::mutex mutex_;  // for take_written() and first_unwritten(), while a frame adds a writer
    struct Writer {
        std::string how;
        bool of_node;
        FrameWriter frames;

        Writer(const OutputTarget& to, std::string how_it_is_made, bool is_of_node, FrameWriter::Write write)
            : how(std::move(how_it_is_made)), of_node(is_of_node), frames({to}, 2, std::move(write))
        {
        }
    };
    std::map<std::string, std::unique_ptr<Writer>> writers_;

    WholeFiles whole_;
    RunFrames selection_{0, 0};  // files in this range may be complete, or become known as such
};

}  // namespace rapid

// The output files of a run: those of -o, and of `:write` and `:rasterize` nodes. Each pattern has a writer of its own.
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

// The folders that files of -o go to, which are made where they are missing; of a pattern with a part that changes from
// output to output, the one above. Error: one can't be made; a text that is no -o.
std::vector<std::filesystem::path> folders_of(const std::vector<std::string>& outputs);

class FrameFiles {
public:
    // outputs: texts of -o. Error: one is none.
    FrameFiles(const std::vector<std::string>& outputs, std::shared_ptr<const PictureOptions> picture);

    // The files are those of a part. Before all below. record: what is known of it before the run; its
    // identity may grow until finish().
    void take_part(std::shared_ptr<const PartRecord> record);

    // Options of the plan, which must keep all attributes that -o names.
    PlanOptions plan_options(std::optional<std::uint64_t> seed) const;

    // What `rapid merge` makes of the parts of a run: its -o, and the pattern of the parts. After resolve(). Error: a
    // picture, which can't be put together; a name with {part}.
    std::vector<std::pair<std::string, std::string>> merges() const;

    // Error: an unknown format; a name that nothing makes; a pattern that stands for one file but gets several frames,
    // or for no output of the graph; two that write the same files.
    void resolve(const Plan& plan, bool several_frames);

    // Adds the names of all files. After resolve(). Error: one that another has, or that is read.
    void claim(WrittenNames& names, const RunFrames& frames) const;
    // The same of the files of nodes, among processes (claim_among_processes).
    void claim(const std::filesystem::path& folder, const std::string& who) const;

    // The files of -o that a frame has, and how they are made besides: two of one path that are made alike are the
    // same.
    struct FrameFile {
        std::string path, how;
        bool film = false;  // one of all frames
    };
    std::vector<FrameFile> files_of(std::int64_t frame, const RunFrames& frames) const;

    // What an earlier run has left whole: it is not written again. By frame and absolute path; films by absolute path.
    struct WholeFiles {
        struct File {
            std::string how;
            std::shared_ptr<const PictureFit> fit;  // of a picture
        };
        std::map<std::int64_t, std::map<std::string, File>> frames;
        std::map<std::string, std::string> films;  // and how they are made
    };
    void go_on_behind(WholeFiles whole, const RunFrames& frames);

    // Queues the files of a frame. Error: one of an earlier frame that could not be written.
    void write(const FrameResult& result);
    // Queues the file of a `:write` or `:rasterize` node.
    void write_node(const std::string& pattern, const PointSet& points, const Frame& frame, double fps);

    // Waits until all files are written; complete: with all frames, else there are no films and no records of a part.
    // Error: one could not be.
    void finish(bool complete = true);

    // The first name of each pattern and output, once it is known; then no more.
    std::vector<std::string> take_first_names() { return std::exchange(first_names_, {}); }

    // Of what files do not hold, once for each.
    std::vector<std::string> take_warnings() { return std::exchange(warnings_, {}); }

    // The files that are complete since the last call; the first frame of which one is still to come, of those that
    // have been queued. From any thread.
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
        std::vector<std::string> outputs;  // whose points it takes
    };
    void resolve(Target& target, const Plan& plan) const;
    void warn_of_texts(const OutputTarget& to, const PointSet& points);
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
    std::map<std::string, std::set<std::string>> unasked_;  // by output: Plan::unasked_columns
    std::shared_ptr<const PictureOptions> picture_;
    std::unique_ptr<SceneOfPlan> scene_;

    std::shared_ptr<const PartRecord> part_;  // null where all points are simulated
    struct Sequence {
        std::string pattern, output;
        double fps;
        std::int64_t start;
        std::map<std::int64_t, std::uint64_t> points = {};  // numbers of points, by frame
    };
    std::map<std::filesystem::path, Sequence> of_part_;  // by the file of the record
    std::set<std::filesystem::path> begun_;              // likewise: those of which a frame was written

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
    RunFrames selection_{0, 0};  // where files are whole, or are to be known as such
};

}  // namespace rapid

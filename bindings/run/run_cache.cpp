#include "bindings/run/run_cache.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <utility>

#include "bindings/run/frame_record_archive.h"
#include "runtime/base/setting_names.h"
#include "runtime/io/state_file.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view snapshot = "snapshot";
const std::string errors_estimated = "the estimate of errors";  // name in a fingerprint

// Contents of a snapshot's file.
struct StoredRun {
    Snapshot snapshot;
    std::uint64_t events = 0;  // length of the log of events

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(snapshot, events);
    }
};

enum class RecordKind : std::uint8_t { Head, Frame, Film };

template <class T>
std::string record_of(RecordKind kind, const T& value)
{
    StateWriter writer;
    writer(static_cast<std::uint8_t>(kind), value);
    const SavedState state = writer.take();
    return {state.bytes.begin(), state.bytes.end()};
}

fs::path absolute_path(const std::string& path) { return fs::absolute(path).lexically_normal(); }

std::string list_of(std::vector<std::string> differences)
{
    constexpr std::size_t most = 8;
    if (differences.size() > most) {
        const std::size_t more = differences.size() - most;
        differences.resize(most);
        differences.push_back(fmt::format("{} more", more));
    }
    return fmt::format("{}", fmt::join(differences, "; "));
}

std::string shown_error(const std::string& file, const std::exception& error)
{
    return fmt::format("{}: {}", file, error.what());
}

}  // namespace

bool WrittenFile::look()
{
    struct stat status = {};
    if (::stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return false;
    bytes = static_cast<std::uint64_t>(status.st_size);
    modified = std::int64_t{status.st_mtim.tv_sec} * 1'000'000'000 + status.st_mtim.tv_nsec;
    return true;
}

bool WrittenFile::is_whole() const
{
    WrittenFile now;
    now.path = path;
    return now.look() && now.bytes == bytes && now.modified == modified;
}

void RunCache::set_graph(const fs::path& graph)
{
    graph_ = graph;
    read_ = std::make_unique<InputContents>(graph.parent_path(), InputContents::Code::Excluded);
}

void RunCache::was_read(const fs::path& file)
{
    if (read_) read_->add(file);
}

void RunCache::refuse(const std::vector<std::string>& differences)
{
    if (!replaces_)
        throw Error(fmt::format(
            "{} {}: the cache belongs to another run: {}; give another folder, or {} to start again",
            name_of(Setting::Cache), folder().string(), list_of(differences), name_of(Setting::CacheAgain)));
    again_ = true;
}

Fingerprint RunCache::with_errors_as_in(const Fingerprint& other) const
{
    Fingerprint likewise = fingerprint_;
    if (const auto was = other.find(errors_estimated); was != other.end()) likewise[errors_estimated] = was->second;
    return likewise;
}

bool RunCache::is_of_run(const Fingerprint& other) const { return hash_of(other) == hash_of(with_errors_as_in(other)); }

void RunCache::read_record(const std::string& record, bool is_first)
{
    SavedState state;
    state.bytes.assign(record.begin(), record.end());
    StateReader reader(state);
    std::uint8_t number = 0;
    reader(number);
    const RecordKind kind{number};
    StateReader::expect((kind == RecordKind::Head) == is_first);
    if (kind == RecordKind::Head) {
        reader(known_.fingerprint);
    } else if (kind == RecordKind::Frame) {
        FrameRecord frame;
        reader(frame);
        for (const auto& [name, hash_then] : frame.read) StateReader::expect(InputContents::is_content(name));
        known_.frames[frame.statistics.frame] = std::move(frame);
    } else {
        WrittenFile film;
        reader(film);
        known_.films[film.path] = film;
    }
    reader.finish();
}

void RunCache::read_journal()
{
    const std::string name = archive_.journal().string();
    const std::optional<FrameArchive::Records> records = archive_.read_journal();
    std::size_t damaged = records ? records->damaged : 0;
    for (std::size_t k = 0; records && k < records->whole.size(); ++k) {
        try {
            read_record(records->whole[k], k == 0);
        } catch (const Error&) {
            ++damaged;
        }
        if (k == 0 && !is_of_run(known_.fingerprint)) break;  // the others may be of another version
    }
    if (!records && !archive_.files(snapshot).empty())
        failures_.push_back(name + " is missing; the cache starts again");
    else if (records && known_.fingerprint.empty())
        failures_.push_back(name + " is damaged; the cache starts again");
    else if (damaged > 0)
        failures_.push_back(fmt::format("{}: {} damaged; frames without a record are computed again", name,
                                        damaged == 1 ? "an entry is" : "some entries are"));
    if (!known_.fingerprint.empty() && !is_of_run(known_.fingerprint))
        refuse(differences(known_.fingerprint, with_errors_as_in(known_.fingerprint)));
    else
        check_contents();
}

// Checks the files that were read in frames; those of the graph are in the fingerprint.
void RunCache::check_contents()
{
    std::vector<std::string> changed;
    for (const auto& [frame, record] : known_.frames)
        for (const auto& [name, hash] : record.read) {
            contents_[name] = hash;
            const std::string now = read_->content_of(name);
            if (now.empty())
                changed.push_back(fmt::format("{} no longer exists", name.substr(name.find(" of ") + 4)));
            else if (now != hash)
                changed.push_back(fmt::format("the {} changed", name));
        }
    if (!changed.empty()) refuse(changed);
}

void RunCache::start_over()
{
    known_ = {};
    contents_.clear();
    for (const auto& [frame, file] : archive_.files(snapshot)) {
        std::error_code ignored;
        fs::remove(file, ignored);
    }
    std::error_code ignored;
    fs::remove(events_log(), ignored);
}

void RunCache::continue_previous()
{
    fingerprint_ = with_errors_as_in(known_.fingerprint);
    const bool requested = std::exchange(estimates_errors_, fingerprint_.at(errors_estimated) == "yes");
    if (requested && !estimates_errors_)
        failures_.push_back(
            fmt::format("{} {}: errors are not estimated, because the run that began the cache did not ({}); give {} "
                        "to estimate them",
                        name_of(Setting::Cache), folder().string(), name_of(Setting::EstimateErrors),
                        name_of(Setting::CacheAgain)));
}

void RunCache::begin(const Session& session, const Plan& plan, const RunFrames& frames, const Fingerprint& options,
                     FrameFiles& files, EventFile& events)
{
    frames_ = frames;
    first_frame_ = plan.first_frame();
    lock_ = FrameArchive::lock(folder(), folder(), "run");
    Fingerprint all = options;
    all.merge(read_->take());
    all[errors_estimated] = estimates_errors_ ? "yes" : "no";
    fingerprint_ = fingerprint_of(session, plan, graph_, all);
    if (!again_) read_journal();
    if (again_ || known_.fingerprint.empty())
        start_over();
    else
        continue_previous();
    known_.fingerprint = fingerprint_;
    find_due(plan, files);
    if (!events.path().empty()) {  // those up to the last frame are known when it is computed
        last_due_ = frames_.last;
        if (!first_due_) first_due_ = last_due_;
        if (every_ > 0 || !archive_.files(snapshot).empty()) events.log_to(events_log());
    }
    std::vector<std::string> records = {record_of(RecordKind::Head, known_.fingerprint)};
    for (const auto& [frame, record] : known_.frames) records.push_back(record_of(RecordKind::Frame, record));
    for (const auto& [path, film] : known_.films) records.push_back(record_of(RecordKind::Film, film));
    archive_.begin_journal(records);
}

void RunCache::find_due(const Plan& plan, FrameFiles& files)
{
    FrameFiles::WholeFiles whole;
    for (const auto& [path, film] : known_.films)
        if (film.is_whole()) whole.films[path] = film.how;
    std::set<std::int64_t> torn;  // frames with an incomplete file of a node
    for (const auto& [frame, record] : known_.frames) {
        if (!frames_.contains(frame)) continue;
        for (const WrittenFile& file : record.files) {
            const bool is_whole = file.is_whole();
            if (is_whole)
                whole.frames[frame][file.path] = {file.how,
                                                  file.fit ? std::make_shared<PictureFit>(*file.fit) : nullptr};
            else if (file.of_node)
                torn.insert(frame);
        }
    }
    leave_waiting_pictures(whole, files);

    const auto is_due = [&](std::int64_t frame) {
        if (!known_.frames.contains(frame) || torn.contains(frame)) return true;
        if (!frames_.contains(frame)) return false;
        for (const FrameFiles::FrameFile& file : files.files_of(frame, frames_)) {
            const std::string path = absolute_path(file.path);
            if (file.film ? !whole.films.contains(path) || whole.films.at(path) != file.how
                          : !whole.frames[frame].contains(path) || whole.frames[frame].at(path).how != file.how)
                return true;
        }
        return false;
    };
    for (std::int64_t frame = plan.first_frame(); frame <= frames_.last; ++frame)
        if (is_due(frame)) {
            if (!first_due_) first_due_ = frame;
            last_due_ = frame;
        }
    files.continue_after(std::move(whole), frames_);
}

// Pictures before the first points wait for these, and then share their camera: all of them are drawn again, or none.
void RunCache::leave_waiting_pictures(FrameFiles::WholeFiles& whole, const FrameFiles& files) const
{
    const std::size_t series = files.files_of(frames_.first, frames_).size();
    for (std::size_t k = 0; k < series; ++k) {
        bool is_whole = true;
        std::vector<std::pair<std::int64_t, std::string>> waited;
        for (std::int64_t frame = frames_.first; frame <= frames_.last; frame += frames_.step) {
            const FrameFiles::FrameFile file = files.files_of(frame, frames_)[k];
            if (file.film || fs::path(file.path).extension() != ".png") break;
            const std::string path = absolute_path(file.path);
            const auto found = whole.frames[frame].find(path);
            waited.emplace_back(frame, path);
            is_whole &= found != whole.frames[frame].end();
            if (found != whole.frames[frame].end() && found->second.fit) break;
        }
        if (!is_whole)
            for (const auto& [frame, path] : waited) whole.frames[frame].erase(path);
    }
}

bool RunCache::load(std::int64_t frame, const fs::path& path, Evaluator& evaluator, EventFile& events)
{
    StoredRun kept;
    try {
        const StateFile file(path);
        const Fingerprint known = file.header().at("fingerprint").get<Fingerprint>();
        Fingerprint of_graph = known;
        std::erase_if(of_graph, [&](const auto& one) {
            return InputContents::is_content(one.first) && !fingerprint_.contains(one.first);
        });
        if (file.header().at("frame") != frame || hash_of(of_graph) != hash_of(fingerprint_))
            throw Error(fmt::format("it belongs to another run: {}", list_of(differences(of_graph, fingerprint_))));
        rapid::restore(kept, file.state());
        if (!events.path().empty()) events.check_log(kept.events);
    } catch (const std::exception& error) {
        failures_.push_back(shown_error(path.string(), error) + "; it is skipped");
        return false;
    }
    evaluator.load(kept.snapshot);
    events.continue_after(kept.events);
    last_kept_ = frame;
    return true;
}

void RunCache::restore(Evaluator& evaluator, EventFile& events)
{
    if (!first_due_) return;
    const std::map<std::int64_t, fs::path> all = archive_.files(snapshot);
    for (auto one = all.rbegin(); one != all.rend(); ++one)
        if (one->first < *first_due_ && one->first >= first_frame_ && load(one->first, one->second, evaluator, events))
            return;
    events.continue_after(0);
}

std::vector<const FrameRecord*> RunCache::records(std::int64_t first, std::int64_t last) const
{
    std::vector<const FrameRecord*> list;
    for (auto one = known_.frames.lower_bound(first); one != known_.frames.end() && one->first <= last; ++one)
        list.push_back(&one->second);
    return list;
}

void RunCache::computed(const FrameFigures& frame)
{
    FrameRecord& record = open_[frame.frame];
    record.statistics = frame;
    record.warnings = std::exchange(warnings_, {});
    record.read = read_->take();
    for (const auto& [name, hash] : record.read) contents_[name] = hash;
    // Files that stay as they are.
    if (const auto known = known_.frames.find(frame.frame); known != known_.frames.end())
        for (const WrittenFile& file : known->second.files)
            if (file.is_whole()) record.files.push_back(file);
}

void RunCache::written(const FrameFiles::Written& file)
{
    WrittenFile one;
    one.path = absolute_path(file.path);
    one.how = file.how;
    one.of_node = file.of_node;
    if (file.film) {
        films_[one.path] = one;
    } else if (const auto open = open_.find(file.frame); open != open_.end()) {
        if (file.fit) one.fit = *file.fit;
        std::vector<WrittenFile>& files = open->second.files;
        std::erase_if(files, [&](const WrittenFile& other) { return other.path == one.path; });
        if (one.look()) files.push_back(std::move(one));
    }
    if (const auto open = open_.find(file.frame); open != open_.end())
        open->second.statistics.seconds.write += file.seconds;
}

void RunCache::complete_before(std::optional<std::int64_t> frame, double seconds, std::uint64_t peak_bytes)
{
    while (!open_.empty() && (!frame || open_.begin()->first < *frame)) {
        FrameRecord& record = open_.begin()->second;
        record.seconds = seconds;
        record.peak_bytes = peak_bytes;
        add(record_of(RecordKind::Frame, record), "; the run continues and computes this frame again");
        open_.erase(open_.begin());
    }
}

void RunCache::add(const std::string& record, const char* so)
{
    try {
        archive_.add(record);
    } catch (const std::exception& error) {
        failures_.push_back(shown_error(archive_.journal().string(), error) + so);
    }
}

void RunCache::keep(const Evaluator& evaluator, EventFile& events, bool in_any_case)
{
    const std::int64_t frame = evaluator.next_frame() - 1;
    if (every_ == 0) return;
    const bool is_due = (frame - first_frame_ + 1) % every_ == 0 || frame == frames_.last;
    if (!(is_due || in_any_case) || last_kept_ == frame || frame < first_frame_) return;
    if (std::string failure = events.take_failure(); !failure.empty()) failures_.push_back(std::move(failure));
    if (!events.path().empty() && !events.logged()) return;
    StoredRun kept{evaluator.save(), events.logged().value_or(0)};
    CheckedJson header = {{"what", "snapshot of a run"}, {"graph", graph_.string()}, {"frame", frame}};
    for (const auto& [name, state] : kept.snapshot.simulations) header["simulations"][name] = state.size();
    for (const auto& [name, state] : kept.snapshot.nodes) header["nodes"][name] = state.size();
    Fingerprint all = fingerprint_;
    all.insert(contents_.begin(), contents_.end());
    header["fingerprint"] = all;
    // The state shares its columns with the run.
    archive_.submit(snapshot, frame, [header = std::move(header), state = state_of(kept)](const fs::path& path) {
        write_state(path, header, state);
    });
    last_kept_ = frame;
}

void RunCache::finish(bool complete)
{
    archive_.finish();
    if (!complete) return;
    for (auto& [path, film] : films_)
        if (film.look()) add(record_of(RecordKind::Film, film), "");
}

std::vector<std::string> RunCache::take_warnings()
{
    std::vector<std::string> all = std::exchange(failures_, {});
    for (std::string& failure : archive_.take_failures()) all.push_back(std::move(failure));
    return all;
}

}  // namespace rapid

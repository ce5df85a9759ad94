#include "bindings/view/frame_cache.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <sstream>
#include <utility>

#include "bindings/command_line/or_throw.h"
#include "runtime/checked_json.h"
#include "runtime/files/input_file.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;
using Json = CheckedJson;

constexpr std::size_t most_runs = 8;
constexpr const char *frame_file = "frame", *shapes_file = "shapes", *snapshot_file = "snapshot";

// For the writer, which knows the file.
void check_written(const Result<Done>& written)
{
    if (!written) throw Error(written.error().message);
}

}  // namespace

CachedRun::CachedRun(fs::path folder, std::string hash, Scene& scene)
    : folder_(std::move(folder)), hash_(std::move(hash))
{
    std::error_code error;
    fs::create_directories(folder_, error);
    if (error) throw Error(fmt::format("--cache {}: can't be made: {}", folder_.string(), error.message()));
    read_index(scene);
    const fs::path index = folder_ / "index";
    // A link would have something appended elsewhere.
    index_ =
        Descriptor(::open(index.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0666));
    if (!index_) throw Error(fmt::format("--cache {}: can't be written: {}", index.string(), std::strerror(errno)));
    fs::last_write_time(index, fs::file_time_type::clock::now(), error);  // used last
    for (const auto& [number, known] : known_) {
        there_[number] = known.shapes;
        last_shapes_ = std::max(last_shapes_, known.shapes);
    }
}

fs::path CachedRun::file(const char* what, std::int64_t number) const
{
    return folder_ / fmt::format("{}.{:04}.rapid", what, number);
}

// A line that a killed process has left unfinished, and frames whose files are not there, are passed over.
void CachedRun::read_index(Scene& scene)
{
    std::error_code none;
    const fs::path path = folder_ / "index";
    if (!fs::exists(fs::symlink_status(path, none))) return;
    const auto text = [&] {
        try {
            return std::string(InputFile(path).text());
        } catch (Error& error) {
            throw error.at({path.string(), 0});
        }
    }();
    std::istringstream index(text);
    for (std::string line; std::getline(index, line);) {
        const Json entry = Json::parse(line, nullptr, false);
        if (!entry.is_object()) continue;
        try {
            const auto number = entry.at("frame").get<std::int64_t>();
            Known known{entry.at("statistics").get<std::string>(), entry.at("warnings").get<std::vector<std::string>>(),
                        entry.at("shapes").get<std::int64_t>()};
            const bool is_whole = fs::exists(file(frame_file, number), none) &&
                                  (known.shapes == 0 || fs::exists(file(shapes_file, known.shapes), none));
            const bool is_same =
                or_throw(scene.are_unchanged(entry.at("read").get<std::map<std::string, std::string>>()));
            if (is_whole && is_same && Json::accept(known.statistics)) known_[number] = std::move(known);
        } catch (const nlohmann::json::exception&) {
            continue;
        }
    }
}

std::int64_t CachedRun::number_of(const SceneShapes& shapes)
{
    if (shapes == SceneShapes()) return 0;
    if (shapes == written_) return written_number_;
    written_ = shapes;
    written_number_ = ++last_shapes_;
    writer_.submit(file(shapes_file, written_number_),
                   [shapes](const fs::path& path) { check_written(shapes.save(path)); });
    return written_number_;
}

void CachedRun::put(const ViewFrame& frame, const std::vector<std::string>& warnings,
                    const std::map<std::string, std::string>& read)
{
    const std::lock_guard lock(mutex_);
    if (there_.contains(frame.number)) return;
    const std::int64_t shapes = number_of(frame.shapes);
    writer_.submit(file(frame_file, frame.number), [points = frame.points, key = hash_](const fs::path& path) {
        check_written(points.save(path, key));
    });
    there_[frame.number] = shapes;
    const Json entry = {{"frame", frame.number},
                        {"shapes", shapes},
                        {"statistics", frame.statistics},
                        {"warnings", warnings},
                        {"read", read}};
    const std::string line = entry.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n';
    // A line that is not written whole is a frame that the next view computes again.
    [[maybe_unused]] const ssize_t written = ::write(index_.number(), line.data(), line.size());
}

void CachedRun::keep(const SceneSnapshot& snapshot)
{
    writer_.submit(file(snapshot_file, snapshot.frame()),
                   [snapshot, key = hash_](const fs::path& path) { check_written(snapshot.write(path, key)); });
}

std::optional<SceneSnapshot> CachedRun::snapshot_before(std::int64_t frame) const
{
    for (std::int64_t number = frame - 1; number >= 0 && !known_.empty() && number >= known_.begin()->first; --number) {
        std::error_code none;
        if (!fs::exists(file(snapshot_file, number), none)) continue;
        Result<SceneSnapshot> snapshot = SceneSnapshot::read(file(snapshot_file, number), hash_);
        if (snapshot) return std::move(*snapshot);
        // A damaged one: an earlier one will do.
    }
    return std::nullopt;
}

bool CachedRun::has(std::int64_t number) const
{
    std::error_code none;
    const std::lock_guard lock(mutex_);
    return there_.contains(number) && fs::exists(file(frame_file, number), none);
}

SceneShapes CachedRun::shapes(std::int64_t number)
{
    if (number == 0) return {};
    if (loaded_number_ == number) return loaded_;
    loaded_ = or_throw(SceneShapes::load(file(shapes_file, number)));
    loaded_number_ = number;
    return loaded_;
}

ViewFramePtr CachedRun::load(std::int64_t number, std::uint64_t run)
{
    const std::lock_guard lock(mutex_);
    const auto there = there_.find(number);
    if (there == there_.end()) return nullptr;
    Result<SceneFrame> loaded = SceneFrame::load(file(frame_file, number), hash_);
    if (!loaded) {  // the next view computes it again
        std::error_code none;
        fs::remove(file(frame_file, number), none);
        there_.erase(there);
    }
    SceneFrame points = or_throw(std::move(loaded));
    return std::make_shared<ViewFrame>(ViewFrame{number, run, std::move(points), "", shapes(there->second)});
}

FrameCache::FrameCache(const fs::path& folder) : folder_(folder / "view")
{
    std::error_code error;
    fs::create_directories(folder_, error);
    if (error) throw Error(fmt::format("--cache {}: can't be made: {}", folder_.string(), error.message()));
    lock_ = Descriptor(::open((folder_ / ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666));
    if (!lock_ && errno == ELOOP)
        throw Error(fmt::format("--cache {}: its .lock is a link; give another folder", folder.string()));
    if (lock_ && ::flock(lock_.number(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
        throw Error(
            fmt::format("--cache {}: another view has it; wait for its end, or give another folder", folder.string()));
}

std::shared_ptr<CachedRun> FrameCache::open(Scene& scene)
{
    const std::string hash = or_throw(scene.fingerprint()).hash;
    auto run = std::make_shared<CachedRun>(folder_ / hash, hash, scene);
    remove_old();
    return run;
}

void FrameCache::remove_old() const
{
    std::vector<std::pair<fs::file_time_type, fs::path>> runs;
    std::error_code error;
    for (fs::directory_iterator entry(folder_, error), end; !error && entry != end; entry.increment(error)) {
        std::error_code none;
        const fs::file_time_type used = fs::last_write_time(entry->path() / "index", none);
        if (!none && entry->is_directory(none)) runs.emplace_back(used, entry->path());
    }
    std::sort(runs.rbegin(), runs.rend());
    for (std::size_t k = most_runs; k < runs.size(); ++k) fs::remove_all(runs[k].second, error);
}

}  // namespace rapid

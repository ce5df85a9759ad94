#include "bindings/view/frame_cache.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <sstream>
#include <utility>

#include "runtime/checked_json.h"
#include "runtime/files/input_file.h"
#include "runtime/io/state_file.h"
#include "runtime/points/state_archive.h"

namespace rapid {
namespace {

namespace fs = std::filesystem;
using Json = CheckedJson;

constexpr std::size_t most_runs = 8;
constexpr const char *frame_file = "frame", *shapes_file = "shapes", *snapshot_file = "snapshot";

// What a frame's file holds.
struct KeptFrame {
    std::map<std::string, PointSet> outputs;

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(outputs);
        if constexpr (Archive::is_loading::value) StateReader::expect(!outputs.empty());
    }
};

// A PictureScene, and back.
struct KeptScene {
    struct Body {
        std::vector<Vec3f> positions;
        std::vector<Mesh::Triangle> triangles;
        std::int32_t role = 0;

        template <class Archive>
        void serialize(Archive& keep)
        {
            keep(positions, triangles, role);
        }
    };
    std::vector<Body> bodies;
    PictureScene rest;  // without bodies

    KeptScene() = default;
    explicit KeptScene(const PictureScene& scene) : rest(scene)
    {
        rest.bodies.clear();
        for (const PictureScene::Body& body : scene.bodies)
            bodies.push_back({body.mesh->positions, body.mesh->triangles, body.role});
    }

    std::shared_ptr<const PictureScene> scene() &&
    {
        for (Body& body : bodies) {
            auto mesh = std::make_shared<Mesh>();
            mesh->positions = std::move(body.positions);
            mesh->triangles = std::move(body.triangles);
            const auto corners = static_cast<std::int32_t>(mesh->positions.size());
            for (const Mesh::Triangle& triangle : mesh->triangles)
                if (triangle.minCoeff() < 0 || triangle.maxCoeff() >= corners) StateReader::fail();
            rest.bodies.push_back({mesh, body.role == PictureScene::Body::Emitter ? PictureScene::Body::Emitter
                                                                                  : PictureScene::Body::Collider});
        }
        return std::make_shared<PictureScene>(std::move(rest));
    }

    template <class Archive>
    void serialize(Archive& keep)
    {
        keep(bodies);
        auto planes = static_cast<std::uint32_t>(rest.planes.size());
        auto styles = static_cast<std::uint32_t>(rest.styles.size());
        keep(planes, styles);
        if constexpr (Archive::is_loading::value) {
            keep_room(keep, planes, rest.planes);
            keep_room(keep, styles, rest.styles);
        }
        for (PictureScene::Plane& plane : rest.planes) keep(plane.normal, plane.offset);
        for (PointStyle& style : rest.styles) keep(style.group, style.additive, style.shutter);
        keep(rest.camera.position, rest.camera.target, rest.camera.fov, rest.camera.group);
    }

private:
    template <class Archive, class T>
    static void keep_room(const Archive& from, std::uint32_t count, std::vector<T>& list)
    {
        from.require(count);
        list.resize(count);
    }
};

}  // namespace

CachedRun::CachedRun(fs::path folder, const Fingerprint& fingerprint, const InputContents& contents)
    : folder_(std::move(folder)), hash_(hash_of(fingerprint))
{
    std::error_code error;
    fs::create_directories(folder_, error);
    if (error) throw Error(fmt::format("--cache {}: can't be made: {}", folder_.string(), error.message()));
    read_index(contents);
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
void CachedRun::read_index(const InputContents& contents)
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
            const auto read = entry.at("read").get<Fingerprint>();
            const bool is_same = std::all_of(read.begin(), read.end(), [&](const auto& one) {
                return InputContents::is_content(one.first) && contents.content_of(one.first) == one.second;
            });
            if (is_whole && is_same && Json::accept(known.statistics)) known_[number] = std::move(known);
        } catch (const nlohmann::json::exception&) {
            continue;
        }
    }
}

std::int64_t CachedRun::number_of(const std::shared_ptr<const PictureScene>& scene)
{
    if (!scene) return 0;
    if (scene == written_) return written_number_;
    written_ = scene;
    written_number_ = ++last_shapes_;
    writer_.submit(file(shapes_file, written_number_), {{"what", "shapes of a view"}}, state_of(KeptScene(*scene)));
    return written_number_;
}

void CachedRun::put(const ViewFrame& frame, const std::vector<std::string>& warnings, const Fingerprint& read)
{
    const std::lock_guard lock(mutex_);
    if (there_.contains(frame.number)) return;
    const std::int64_t shapes = number_of(frame.scene);
    writer_.submit(file(frame_file, frame.number),
                   {{"what", "frame of a view"}, {"fingerprint", hash_}, {"frame", frame.number}},
                   state_of(KeptFrame{frame.outputs}));
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

void CachedRun::keep(const Snapshot& snapshot)
{
    writer_.submit(file(snapshot_file, snapshot.frame),
                   {{"what", "snapshot of a view"}, {"fingerprint", hash_}, {"frame", snapshot.frame}},
                   state_of(snapshot));
}

std::optional<Snapshot> CachedRun::snapshot_before(std::int64_t frame) const
{
    for (std::int64_t number = frame - 1; number >= 0 && !known_.empty() && number >= known_.begin()->first; --number) {
        std::error_code none;
        if (!fs::exists(file(snapshot_file, number), none)) continue;
        try {
            const StateFile kept(file(snapshot_file, number));
            if (kept.header().at("fingerprint") != hash_) continue;
            Snapshot snapshot;
            restore(snapshot, kept.state());
            return snapshot;
        } catch (const std::exception&) {  // a damaged one: an earlier one will do
            continue;
        }
    }
    return std::nullopt;
}

bool CachedRun::has(std::int64_t number) const
{
    std::error_code none;
    const std::lock_guard lock(mutex_);
    return there_.contains(number) && fs::exists(file(frame_file, number), none);
}

std::shared_ptr<const PictureScene> CachedRun::shapes(std::int64_t number)
{
    if (number == 0) return nullptr;
    if (loaded_ && loaded_number_ == number) return loaded_;
    KeptScene kept;
    restore(kept, StateFile(file(shapes_file, number)).state());
    loaded_ = std::move(kept).scene();
    loaded_number_ = number;
    return loaded_;
}

ViewFramePtr CachedRun::load(std::int64_t number, std::uint64_t run)
{
    const std::lock_guard lock(mutex_);
    const auto there = there_.find(number);
    if (there == there_.end()) return nullptr;
    const StateFile kept(file(frame_file, number));
    if (kept.header().at("fingerprint") != hash_) throw Error("it is of another run").at({file(frame_file, number), 0});
    KeptFrame frame;
    restore(frame, kept.state());
    auto result = std::make_shared<ViewFrame>();
    result->number = number;
    result->run = run;
    result->outputs = std::move(frame.outputs);
    result->scene = shapes(there->second);
    return result;
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

std::shared_ptr<CachedRun> FrameCache::open(const Fingerprint& fingerprint, const InputContents& contents)
{
    auto run = std::make_shared<CachedRun>(folder_ / hash_of(fingerprint), fingerprint, contents);
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

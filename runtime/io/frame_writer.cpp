#include "runtime/io/frame_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "runtime/base/stopwatch.h"
#include "runtime/picture/frame_picture.h"

namespace rapid {
namespace {

constexpr std::size_t max_waiting = 100;  // pictures; each may hold several megabytes of shapes

}  // namespace

FrameWriter::FrameWriter(const std::vector<OutputTarget>& targets, std::size_t waiting, Write write)
    : waiting_(waiting), write_(std::move(write))
{
    for (const OutputTarget& target : targets) {
        const Format& format = format_of(target.pattern);
        const bool picture = format.film || format.extension == ".png";
        targets_.push_back({FramePattern(target.pattern), target.attributes, picture, format.film});
    }
    thread_ = std::thread([this] { run(); });
}

FrameWriter::~FrameWriter()
{
    {
        const std::lock_guard lock(mutex_);
        jobs_.clear();
        stopping_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

void FrameWriter::submit(PointSet points, FrameInfo frame, std::string output, std::shared_ptr<const PictureFit> before)
{
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return error_ || jobs_.size() < std::max<std::size_t>(1, waiting_); });
    if (error_) std::rethrow_exception(error_);
    due_[frame.number] += targets_.size();
    jobs_.push_back({std::move(points), std::move(frame), std::move(output), std::move(before)});
    changed_.notify_all();
}

void FrameWriter::finish(bool complete)
{
    {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return error_ || (jobs_.empty() && !busy_); });
        if (error_) std::rethrow_exception(error_);
    }
    for (auto& [output, pictures] : pictures_) {
        if (!pictures.waiting.empty()) write_without_points(pictures);
        pictures.painter.reset();  // releases the shapes of the last frame
    }
    const auto films = std::exchange(films_, {});
    if (!complete) return;
    for (const auto& [path, running] : films) try {
            running->film.finish();
            running->file.finish();
        } catch (Error& error) {
            throw error.at({path, 0});
        }
}

void FrameWriter::add_to_film(const std::string& path, const PointSet& points, const FrameInfo& frame)
{
    const Picture picture = picture_of(points, frame);
    std::unique_ptr<RunningFilm>& running = films_[path];
    if (!running) running = std::make_unique<RunningFilm>(path, picture, frame.fps);
    running->film.add(picture);
}

std::vector<FrameWriter::Written> FrameWriter::take_written()
{
    const std::lock_guard lock(mutex_);
    return std::exchange(written_, {});
}

std::optional<int> FrameWriter::first_unwritten() const
{
    const std::lock_guard lock(mutex_);
    return due_.empty() ? std::nullopt : std::optional(due_.begin()->first);
}

void FrameWriter::run()
{
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock, [&] { return stopping_ || !jobs_.empty(); });
        if (jobs_.empty()) return;
        std::optional<Job> job(std::move(jobs_.front()));
        jobs_.pop_front();
        busy_ = true;
        changed_.notify_all();
        lock.unlock();

        std::exception_ptr error;
        try {
            write(*job);
        } catch (...) {
            error = std::current_exception();
        }
        job.reset();  // releases its columns before a blocked submit() continues

        lock.lock();
        busy_ = false;
        if (error) {
            error_ = error;
            jobs_.clear();
        }
        changed_.notify_all();
        if (error) return;
    }
}

void FrameWriter::write(const Job& job)
{
    std::shared_ptr<const PictureView> view = job.frame.view;
    for (const Target& target : targets_) {
        std::shared_ptr<const PictureFit> fit;
        if (target.picture && !view) {
            Pictures& pictures = pictures_[job.output];
            if (job.before) pictures.fit = *job.before;
            if (job.points.empty() && !pictures.fit.settled()) {
                pictures.waiting.emplace_back(&target, job);
                if (pictures.waiting.size() == max_waiting) write_without_points(pictures);
                continue;
            }
            view = std::make_shared<PictureView>(pictures.fit.next(job.points, job.frame));
            write_waiting(pictures, view);
            if (!target.film) fit = std::make_shared<PictureFit>(pictures.fit);
        }
        write_file(target, job, view, std::move(fit));
    }
}

void FrameWriter::write_without_points(Pictures& pictures)
{
    const Job& last = pictures.waiting.back().second;
    write_waiting(pictures, std::make_shared<PictureView>(pictures.fit.next(last.points, last.frame)));
}

void FrameWriter::write_waiting(Pictures& pictures, const std::shared_ptr<const PictureView>& view)
{
    for (const auto& [target, job] : std::exchange(pictures.waiting, {})) write_file(*target, job, view, nullptr);
}

void FrameWriter::write_file(const Target& target, const Job& job, std::shared_ptr<const PictureView> view,
                             std::shared_ptr<const PictureFit> fit)
{
    const Stopwatch stopwatch;
    const std::string path = target.pattern.expand(job.frame.number, job.output);
    FrameInfo frame = job.frame;
    frame.view = std::move(view);
    if (target.picture) {
        std::shared_ptr<Painter>& painter = pictures_[job.output].painter;
        if (!painter) painter = std::make_shared<Painter>();
        frame.painter = painter;
    }
    try {
        const PointSet points = target.attributes ? select_attributes(job.points, *target.attributes) : job.points;
        if (target.film)
            add_to_film(path, points, frame);
        else if (write_)
            write_(path, points);
        else
            write_points(path, points, frame);
    } catch (Error& error) {
        throw error.at({path, 0});
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {  // from a library
        throw Error(error.what()).at({path, 0});
    }
    const double spent = stopwatch.seconds();
    std::error_code ignored;
    const std::uintmax_t bytes = std::filesystem::file_size(path, ignored);
    const std::lock_guard lock(mutex_);
    written_.push_back({job.frame.number, path, spent, bytes, std::chrono::steady_clock::now(), target.film,
                        std::move(fit), job.points.size()});
    if (--due_[job.frame.number] == 0) due_.erase(job.frame.number);
}

PointSet select_attributes(const PointSet& points, const std::vector<std::string>& names)
{
    for (const std::string& name : names)
        if (!points.has(name) && !points.find_group(name)) {
            std::vector<std::string> known = points.column_names();
            for (const std::string& group : points.group_names()) known.push_back(group);
            throw Error(
                fmt::format("there is no attribute or group \"{}\" to write{}", name, did_you_mean(name, known)));
        }
    const auto is_requested = [&](const std::string& name) {
        return name == "P" || name == "v" || name == "id" || std::find(names.begin(), names.end(), name) != names.end();
    };
    PointSet selected = points;
    for (const std::string& name : points.column_names())
        if (!is_requested(name)) selected.remove(name);
    for (const std::string& name : points.group_names())
        if (!is_requested(name)) selected.remove_group(name);
    return selected;
}

}  // namespace rapid

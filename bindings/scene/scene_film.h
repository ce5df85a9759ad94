// Films of frames, by the renderer of `rapid run -o film.mp4`; ffmpeg, a program of its own, encodes them.
//
//   auto film = rapid::SceneFilm::begin("film.mp4");
//   for (const rapid::SceneFrame& frame : frames) film->add(frame, *scene.shapes(frame.number()));
//   film->finish();
//
// Errors and units are those of rapid/scene.h. A film is used by one thread at a time.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "include/rapid/scene.h"
#include "include/rapid/shapes.h"

namespace rapid {

// How a film is made.
struct FilmOptions {
    double fps = 24;       // pictures a second, from 1 to 1000
    PictureSize size;      // of .mp4 and .webm with even edges
    PictureCamera camera;  // what is left open is fitted, and follows the points without jumps
};

// A film that is being made.
class SceneFilm {
public:
    // path: a file of .mp4, .webm or .gif. Error: another extension; a pattern of several files; a rate, a size or an
    // angle of view that can't be; no ffmpeg on the PATH.
    static Result<SceneFilm> begin(const std::string& path, const FilmOptions& options = {});

    // What is moved from may only be assigned to, or end.
    SceneFilm(SceneFilm&&) noexcept;
    SceneFilm& operator=(SceneFilm&&) noexcept;
    ~SceneFilm();  // without finish() there is no file

    // The next picture, which a thread of the film's own draws; waits while another one waits. Error: of this or of an
    // earlier picture, after which there will be no film; what ffmpeg says.
    Result<Done> add(const SceneFrame& frame, const SceneShapes& shapes);
    // The pictures that were in the film at the last add(), or finish().
    std::int64_t done() const;
    // Waits until all are; the file then has its name, and nothing is added any more. Error: as add(); no picture was
    // added.
    Result<Done> finish();

private:
    struct Impl;
    explicit SceneFilm(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace rapid

// Films of frames, by the renderer of `rapid run -o film.mp4`. ffmpeg, a separate program, encodes them.
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

// Options of a film.
struct FilmOptions {
    double fps = 24;       // pictures a second, from 1 to 1000
    PictureSize size;      // of .mp4 and .webm with even edge lengths
    PictureCamera camera;  // missing values are fitted, and follow the points without jumps
};

// A film in progress.
class SceneFilm {
public:
    // path: a file of .mp4, .webm or .gif. Error: another extension; a pattern of several files; an impossible rate,
    // size or angle of view; no ffmpeg on the PATH.
    static Result<SceneFilm> begin(const std::string& path, const FilmOptions& options = {});

    // A moved-from film may only be assigned to or destroyed.
    SceneFilm(SceneFilm&&) noexcept;
    SceneFilm& operator=(SceneFilm&&) noexcept;
    ~SceneFilm();  // without finish() there is no file

    // Adds a picture, which the film's own thread draws; waits while another one waits. Error: one of this or of an
    // earlier picture, after which there will be no film; ffmpeg's message.
    Result<Done> add(const SceneFrame& frame, const SceneShapes& shapes);
    // Returns the number of pictures in the film at the last add() or finish().
    std::int64_t done() const;
    // Waits until all are done; the file then has its name, and nothing more can be added. Error: as in add(); no
    // picture was added.
    Result<Done> finish();

private:
    struct Impl;
    explicit SceneFilm(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

}  // namespace rapid

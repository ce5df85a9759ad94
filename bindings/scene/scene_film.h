// Films of frames, by the renderer of `rapid run -o film.mp4`. ffmpeg, a separate program, encodes them.
//
//   auto film = rapid::SceneFilm::begin("film.mp4");
//   for (const rapid::SceneFrame& frame : frames) film->add(frame, *scene.shapes(frame.number()));
//   film->finish();
//
// Errors and units are those of rapid/scene.h. A film is used by one thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

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
    // path: a file of .mp4, .webm or .gif. Fails if the extension is another one, if the path is a pattern of several
    // files, if the rate, size or angle of view is impossible, or if there is no ffmpeg on the PATH.
    static Result<SceneFilm> begin(const std::string& path, const FilmOptions& options = {});

    // A moved-from film may only be assigned to or destroyed.
    SceneFilm(SceneFilm&&) noexcept;
    SceneFilm& operator=(SceneFilm&&) noexcept;
    ~SceneFilm();  // without finish() there is no file

    // Adds a picture, which the film's own thread draws; waits while another one waits. Fails with ffmpeg's message if
    // this or an earlier picture failed; there will then be no film.
    Result<Done> add(const SceneFrame& frame, const SceneShapes& shapes);
    // Returns the number of pictures in the film at the last add() or finish().
    std::int64_t done() const;
    // Waits until all are done; the file then has its name, and nothing more can be added. Fails like add(), and if no
    // picture was added.
    Result<Done> finish();

private:
    struct Impl;
    explicit SceneFilm(std::unique_ptr<Impl> impl);
    std::unique_ptr<Impl> impl_;
};

// One of the pictures.
struct SheetPicture {
    std::string file;                // a .png; empty: none, and its place stays free
    std::vector<std::string> label;  // lines of ASCII, truncated to fit
};

// Returns the bytes of a .png with these pictures from left to right and from the top, in about as many rows as
// columns; at most 8,192 pixels wide. All are fitted into the shape of the first picture. `series` pictures each form a
// series, which begins a row or lies in one, if possible. Callable from any thread. Fails if a series is empty, if
// there are more than 4,096 pictures, if one is more than 16 times as high as wide, or if a file cannot be read or is
// not a .png.
Result<std::string> picture_sheet(const std::vector<SheetPicture>& pictures, std::size_t series = 1);

}  // namespace rapid

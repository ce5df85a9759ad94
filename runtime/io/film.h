// Films, which the external program ffmpeg encodes from pictures.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>

#include "runtime/files/output_file.h"
#include "runtime/picture/picture.h"

namespace rapid {

// A film that is being written. Pictures are sent to ffmpeg through a socket and are stored nowhere. The file gets its
// name when it is complete, and disappears otherwise (OutputFile).
class Film {
public:
    // extension: .mp4, .webm or .gif. Throws Error if there is no ffmpeg (require_ffmpeg()) or the format does not
    // allow the size.
    Film(OutputFile& file, std::string_view extension, int width, int height, double fps);
    Film(const Film&) = delete;
    Film& operator=(const Film&) = delete;
    // Ends ffmpeg, unless finish() has.
    ~Film();

    // Adds a picture of the film's size. Throws Error with ffmpeg's message.
    void add(const Picture& picture);
    // Waits for ffmpeg. Throws Error with its message.
    void finish();

private:
    [[noreturn]] void fail();
    int wait();

    Descriptor frames_;    // to ffmpeg's standard input
    Descriptor messages_;  // ffmpeg's output, in an unnamed file
    pid_t ffmpeg_ = -1;    // -1 once it has ended
    std::optional<WritingProgram> writing_;
};

// Throws Error if ffmpeg is not on the PATH. The message names the package to install.
void require_ffmpeg();

// Returns true if the format requires even edges, because its colours are halved in both directions (4:2:0).
bool needs_even_edges(std::string_view extension);

}  // namespace rapid

// Films: pictures that ffmpeg, a program of its own, makes one file of.
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

// A film that is being written. Pictures go through a socket to ffmpeg, and are stored nowhere. The file has its name
// when it is complete, and is gone where it is not (OutputFile).
class Film {
public:
    // extension: .mp4, .webm or .gif. Error: no ffmpeg (require_ffmpeg()); a size that the format can't have.
    Film(OutputFile& file, std::string_view extension, int width, int height, double fps);
    Film(const Film&) = delete;
    Film& operator=(const Film&) = delete;
    // Ends ffmpeg, where finish() has not.
    ~Film();

    // The next picture, of the film's size. Error: what ffmpeg says.
    void add(const Picture& picture);
    // Waits for ffmpeg. Error: what it says.
    void finish();

private:
    [[noreturn]] void fail();
    int wait();

    Descriptor frames_;    // to ffmpeg's input
    Descriptor messages_;  // what it says, a file without a name
    pid_t ffmpeg_ = -1;    // -1: it has ended
    std::optional<WritingProgram> writing_;
};

// Error: there is no ffmpeg on the PATH, with the package that has it.
void require_ffmpeg();

// A film of even edges only: its colours are halved along both (4:2:0).
bool needs_even_edges(std::string_view extension);

}  // namespace rapid

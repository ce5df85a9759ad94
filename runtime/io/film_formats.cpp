// .mp4, .webm, .gif: films (film.h). FrameWriter makes one film of all frames; here a film has a single picture.
#include "runtime/io/film.h"
#include "runtime/io/format.h"
#include "runtime/picture/frame_picture.h"

namespace rapid {
namespace {

template <const char* extension>
void write_film(OutputFile& file, const PointSet& points, const FrameInfo& frame)
{
    const Picture picture = picture_of(points, frame);
    Film film(file, extension, picture.width, picture.height, frame.fps);
    film.add(picture);
    film.finish();
}

constexpr char mp4[] = ".mp4", webm[] = ".webm", gif[] = ".gif";

const FormatRegistration films[] = {
    FormatRegistration(Format{mp4, "a film, made by ffmpeg (H.264)", write_film<mp4>, nullptr, true}),
    FormatRegistration(Format{webm, "a film, made by ffmpeg (VP9)", write_film<webm>, nullptr, true}),
    FormatRegistration(Format{gif, "a film of few colours, made by ffmpeg", write_film<gif>, nullptr, true}),
};

}  // namespace
}  // namespace rapid

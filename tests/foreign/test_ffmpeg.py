"""ffprobe and ffmpeg read films and pictures."""
import json

import numpy

from programs import ExchangeTest, needs

SCENE = """return rapid.create { fps = 25, points = rapid.points.from {
  P = {{-1, 0, 0}, {1, 0, 0}}, Cd = {{1, 0, 0}, {0, 0, 1}}, pscale = {0.3, 0.3} } }"""


@needs("ffprobe")
class FfmpegTest(ExchangeTest):
    def stream(self, file):
        printed = self.run_program("ffprobe", "-v", "error", "-count_frames", "-show_streams", "-of", "json", file)
        [stream] = json.loads(printed)["streams"]
        return stream

    def test_films_have_their_frames_size_and_rate(self):
        files = ["a.mp4", "a.webm", "a.gif"]
        self.scene(SCENE, "-f", "1-10", "--size", "160x90", *[part for file in files for part in ("-o", file)])
        for file, codec in zip(files, ("h264", "vp9", "gif")):
            stream = self.stream(file)
            self.assertEqual((stream["codec_name"], stream["width"], stream["height"]), (codec, 160, 90))
            self.assertEqual(stream["nb_read_frames"], "10", file)
            self.assertEqual(stream["r_frame_rate"], "25/1", file)

    def test_a_picture_has_the_colours_of_its_points(self):
        camera = "0,0,5,0,0,0,40"
        self.scene(SCENE, "-f", "1", "--size", "160x90", "--camera", camera, "-o", "a.png")
        self.run_program("ffmpeg", "-v", "error", "-i", "a.png", "-f", "rawvideo", "-pix_fmt", "rgb24", "a.raw")
        pixels = numpy.fromfile(self.path / "a.raw", numpy.uint8).reshape(90, 160, 3).astype(int)
        # x = -1 and 1 at a distance of 5, in a view of 40 degrees.
        off = round(1 / 5 / numpy.tan(numpy.radians(20)) * 45)
        left, right = pixels[45, 80 - off], pixels[45, 80 + off]
        self.assertGreater(left[0], 2 * left[2], left)
        self.assertGreater(right[2], 2 * right[0], right)

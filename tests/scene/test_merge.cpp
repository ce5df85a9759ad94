// Merged parts of a run: all points in the order of their ids, and parts that do not form a whole.
//
//   WRONG_MERGES=2000 test_scene "a merge of wrong parts*"      more of them; WRONG_MERGES_SEED=7 for others
#include <array>
#include <filesystem>
#include <functional>
#include <random>
#include <regex>
#include <vector>

#include "include/rapid/merge.h"
#include "runtime/files/content_hash.h"
#include "runtime/files/input_file.h"
#include "tests/amount.h"
#include "tests/files/temporary_folder.h"
#include "tests/scene/opened.h"
#include "tests/test.h"

namespace rapid {
namespace {

using Catch::Contains;
using namespace std::string_literals;
using test::good;

constexpr int points = 100;

// Returns the part, of two, to which an id belongs (docs/scale.md): the upper half of SplitMix64's values is the second
// part's.
int part_of(std::uint64_t id)
{
    std::uint64_t bits = id + 0x9e3779b97f4a7c15u;
    bits = (bits ^ bits >> 30) * 0xbf58476d1ce4e5b9u;
    bits = (bits ^ bits >> 27) * 0x94d049bb133111ebu;
    return (bits ^ bits >> 31) >> 63 ? 2 : 1;
}

// Two parts of a run of three frames, with points at x = id, y = frame.
struct Parts {
    test::TemporaryFolder folder;

    Parts()
    {
        for (int part = 1; part <= 2; ++part) {
            for (int frame = 1; frame <= 3; ++frame) write_frame(part, part, frame);
            write_record(part);
        }
    }
    std::string file_of(int part, int frame) const
    {
        return folder / ("x_part" + std::to_string(part) + "of2.000" + std::to_string(frame) + ".csv");
    }
    void write_record(int part) const
    {
        std::string files;
        for (int frame = 1; frame <= 3; ++frame)
            files += (frame > 1 ? ", " : "") + R"({"frame": )"s + std::to_string(frame) +
                     R"(, "points": 50, "hash": ")" + hash_text(file_hash(file_of(part, frame))) + "\"}";
        folder.write("x_part" + std::to_string(part) + "of2.csv.json",
                     R"({"rapid_part": 2, "part": )" + std::to_string(part) +
                         R"(, "parts": 2, "sample": null, "frames": {"first": 1, "last": 3, "step": 1},
                             "fps": 24, "start": 1, "identity": {"rate": "100"}, "files": [)" +
                         files + "]}");
    }
    void write_frame(int part, int of, int frame) const
    {
        std::string rows = "id,Px,Py,Pz,vx,vy,vz\n";
        for (int id = 0; id < points; ++id)
            if (part_of(id) == of)
                rows += std::to_string(id) + ',' + std::to_string(id) + ',' + std::to_string(frame) + ",0,0,0,0\n";
        folder.write(std::filesystem::path(file_of(part, frame)).filename().string(), rows);
    }
    std::string all() const { return folder / "x_part{part}.####.csv"; }
};

}  // namespace

TEST_CASE("merged parts are the points of all, in the order of their ids", "[merge]")
{
    const Parts parts;
    const std::string whole = parts.folder / "deep/whole.####.bgeo";
    std::vector<std::int64_t> reported;
    const MergedFiles merged = good(merge_files({parts.all()}, whole, [&](std::int64_t frame, std::uint64_t count) {
        CHECK(count == points);
        reported.push_back(frame);
        return true;
    }));
    CHECK(merged.parts == 2);
    CHECK(merged.frames == 3);
    CHECK(merged.points == 3 * points);
    CHECK(reported == std::vector<std::int64_t>{1, 2, 3});

    const SceneFrame frame = good(SceneFrame::read(parts.folder / "deep/whole.0002.bgeo"));
    const SceneColumn id = good(frame.column("id")), P = good(frame.column("P"));
    REQUIRE(id.count == points);
    for (std::size_t i = 0; i < points; ++i) {
        REQUIRE(*id.at<std::int64_t>(i) == static_cast<std::int64_t>(i));
        REQUIRE(P.at<float>(i)[0] == static_cast<float>(i));
        REQUIRE(P.at<float>(i)[1] == 2);
    }
}

TEST_CASE("a merge ends after a whole frame when the program requests it", "[merge]")
{
    const Parts parts;
    const std::string whole = parts.folder / "whole.####.csv";
    const Result<MergedFiles> merged =
        merge_files({parts.all()}, whole, [](std::int64_t frame, std::uint64_t) { return frame < 2; });
    REQUIRE_FALSE(merged);
    CHECK(merged.error().kind == SceneError::Cancelled);
    CHECK(good(SceneFrame::read(parts.folder / "whole.0002.csv")).size() == points);
    CHECK_FALSE(std::filesystem::exists(parts.folder / "whole.0003.csv"));

    const Result<MergedFiles> thrown = merge_files(
        {parts.all()}, whole, [](std::int64_t, std::uint64_t) -> bool { throw std::runtime_error("no more"); });
    REQUIRE_FALSE(thrown);
    CHECK_THAT(thrown.error().message, Contains("the program's progress threw: no more"));
}

TEST_CASE("parts that are no whole are refused before anything is written", "[merge]")
{
    const Parts parts;
    const std::string whole = parts.folder / "whole.####.csv";
    const auto fault = [&](const std::vector<std::string>& of, const std::string& output) {
        const Result<MergedFiles> merged = merge_files(of, output);
        REQUIRE_FALSE(merged);
        CHECK(merged.error().kind == SceneError::WrongCall);
        return merged.error().text();
    };
    CHECK_THAT(fault({}, whole), Contains("no parts are given"));
    CHECK_THAT(fault({parts.folder / "x_part1of2.####.csv"}, whole), Contains("missing is part 2of2"));
    CHECK_THAT(fault({parts.folder / "y_part{part}.####.csv"}, whole),
               Contains("there is no complete part with this name"));
    CHECK_THAT(fault({parts.all()}, parts.folder / "whole.####.png"),
               Contains("a .png file can't store points; merge into another format"));
    CHECK_THAT(fault({parts.all()}, parts.folder / "whole.csv"), Contains("several frames would go into one file"));
    CHECK_THAT(fault({parts.all()}, parts.folder / "x_part1of2.####.csv"), Contains("would replace"));
    std::filesystem::remove(parts.folder / "x_part2of2.0003.csv");
    CHECK_THAT(fault({parts.all()}, whole), Contains("a frame is missing: 3"));
    CHECK_FALSE(std::filesystem::exists(parts.folder / "whole.0001.csv"));
}

TEST_CASE("a point of another part ends a merge in its frame", "[merge]")
{
    const Parts parts;
    parts.write_frame(2, 1, 2);
    parts.write_record(2);
    const Result<MergedFiles> merged = merge_files({parts.all()}, parts.folder / "whole.####.csv");
    REQUIRE_FALSE(merged);
    CHECK(merged.error().kind == SceneError::FailedFrame);
    CHECK_THAT(merged.error().text(), Contains("is not of part 2 of 2, but of part 1"));
    CHECK(std::filesystem::exists(parts.folder / "whole.0001.csv"));
    CHECK_FALSE(std::filesystem::exists(parts.folder / "whole.0002.csv"));
}

TEST_CASE("a merge refuses files that are not those that their part has written", "[merge]")
{
    struct Fault {
        const char* name;
        std::function<std::string(const Parts&, const std::string& file)> change;  // returns the file's new bytes
    };
    const auto bytes_of = [](const std::string& file) { return std::string(InputFile(file).text()); };
    const Fault faults[] = {
        {"another frame", [&](const Parts& parts, const std::string&) { return bytes_of(parts.file_of(2, 1)); }},
        {"the last point is missing",
         [&](const Parts&, const std::string& file) {
             const std::string bytes = bytes_of(file);
             return bytes.substr(0, bytes.rfind('\n', bytes.size() - 2) + 1);
         }},
        {"a point too many",
         [&](const Parts&, const std::string& file) {
             std::string bytes = bytes_of(file);
             const std::size_t last = bytes.rfind('\n', bytes.size() - 2) + 1;
             return bytes + "1000" + bytes.substr(bytes.find(',', last));
         }},
        {"the values of another seed",
         [&](const Parts&, const std::string& file) {
             std::string bytes = bytes_of(file);
             return bytes.replace(bytes.rfind(",0,"), 3, ",1,");
         }},
    };
    for (const Fault& fault : faults) {
        CAPTURE(fault.name);
        const Parts parts;
        const std::string file = parts.file_of(2, 2);
        parts.folder.write(std::filesystem::path(file).filename().string(), fault.change(parts, file));
        const Result<MergedFiles> merged = merge_files({parts.all()}, parts.folder / "whole.####.csv");
        REQUIRE_FALSE(merged);
        CHECK(merged.error().kind == SceneError::FailedFrame);
        CHECK_THAT(merged.error().text(),
                   Contains("x_part2of2.0002.csv") && Contains("was changed after the part wrote it"));
        CHECK_FALSE(std::filesystem::exists(parts.folder / "whole.0002.csv"));
    }
}

namespace {

// Two parts with one random fault.
class WrongParts {
public:
    explicit WrongParts(std::uint64_t seed) : random_(seed) {}

    // Damages a part and describes how.
    std::string damage()
    {
        switch (below(5)) {
            case 0:
                return remove();
            case 1:
                return change_record();
            default:
                return change_file();
        }
    }

    Result<MergedFiles> merge() const { return merge_files(given_, whole()); }
    // Returns true if the written frames are exactly those of the whole before the first wrong one.
    bool is_right_so_far() const
    {
        const Parts right;
        REQUIRE(merge_files({right.all()}, right.folder / "whole.####.csv"));
        for (int frame = 1; frame <= 3; ++frame) {
            const std::string name = "whole.000" + std::to_string(frame) + ".csv";
            if (!std::filesystem::exists(parts_.folder / name)) continue;
            if (frame >= wrong_frame_ || bytes_of(parts_.folder / name) != bytes_of(right.folder / name)) return false;
        }
        return true;
    }

private:
    std::size_t below(std::size_t n) { return static_cast<std::size_t>(random_() % n); }
    std::string whole() const { return parts_.folder / "whole.####.csv"; }
    static std::string bytes_of(const std::string& file) { return std::string(InputFile(file).text()); }
    void write(const std::string& file, const std::string& bytes) const
    {
        parts_.folder.write(std::filesystem::path(file).filename().string(), bytes);
    }

    std::string remove()
    {
        const std::string part = std::to_string(1 + below(2)), record = "x_part" + part + "of2.csv.json";
        switch (below(4)) {
            case 0:
                std::filesystem::remove(parts_.folder / record);
                return "no " + record;
            case 1:
                given_ = {parts_.folder / ("x_part" + part + "of2.####.csv")};
                return "part " + part + " alone";
            case 2:
                given_.push_back(parts_.folder / ("x_part" + part + "of2.####.csv"));
                return "part " + part + " twice";
            default: {
                const std::string file = parts_.file_of(std::stoi(part), static_cast<int>(1 + below(3)));
                std::filesystem::remove(file);
                return "no " + file;
            }
        }
    }

    std::string change_record()
    {
        static constexpr std::array<std::array<const char*, 2>, 12> changes = {
            {{R"("rapid_part": 2)", R"("rapid_part": 1)"},
             {R"("parts": 2)", R"("parts": 3)"},
             {R"("part": 2)", R"("part": 1)"},
             {R"("part": 2)", R"("part": 3)"},
             {R"("sample": null)", R"("sample": 0.5)"},
             {R"("last": 3)", R"("last": 4)"},
             {R"("step": 1)", R"("step": 2)"},
             {R"("fps": 24)", R"("fps": 25)"},
             {R"("rate": "100")", R"("rate": "101")"},
             {R"("rate": "100")", R"("--seed": "7")"},
             {R"("identity")", R"("identities")"},
             {"}", "]"}}};
        const std::string file = parts_.folder / "x_part2of2.csv.json";
        const std::size_t which = below(changes.size());
        const auto [from, to] = changes[which];
        std::string text = bytes_of(file);
        text.replace(text.find(from), std::string_view(from).size(), to);
        write(file, text);
        return std::string("in the record ") + from + " becomes " + to;
    }

    // Changes the file of a frame without its record.
    std::string change_file()
    {
        const int part = static_cast<int>(1 + below(2)), frame = static_cast<int>(1 + below(3));
        const std::string file = parts_.file_of(part, frame);
        std::string bytes = bytes_of(file);
        const std::string before = bytes, what = make_other(bytes, part, frame);
        if (bytes == before) bytes += "999,1,1,1,0,0,0\n";
        write(file, bytes);
        wrong_frame_ = frame;
        return what + ": frame " + std::to_string(frame) + " of part " + std::to_string(part);
    }

    std::string make_other(std::string& bytes, int part, int frame)
    {
        const auto line_after = [&](std::size_t at) { return bytes.find('\n', at) + 1; };
        const std::size_t at = below(bytes.size() - 1), line = line_after(at), next = line_after(line);
        switch (below(8)) {
            case 0:
                bytes = bytes_of(parts_.file_of(part, 1 + frame % 3));
                return "another frame";
            case 1:
                bytes = bytes_of(parts_.file_of(3 - part, frame));
                return "another part";
            case 2:
                bytes.resize(line);
                return "points lost at the end";
            case 3:
                bytes.resize(at);
                return "truncated";
            case 4:
                if (line < bytes.size()) bytes.erase(line, next - line);
                return "a point lost";
            case 5:
                if (line < bytes.size()) bytes.insert(line, bytes.substr(line, next - line));
                return "a point twice";
            case 6:  // ids stay, values change
                bytes = std::regex_replace(bytes, std::regex(",0,"), "," + std::to_string(1 + below(9)) + ",");
                return "another seed";
            default:
                bytes[at] = static_cast<char>(bytes[at] ^ 1 << below(7));
                return "a bit";
        }
    }

    std::mt19937_64 random_;
    const Parts parts_;
    std::vector<std::string> given_{parts_.all()};
    int wrong_frame_ = 1;  // the first one
};

}  // namespace

TEST_CASE("a merge of wrong parts is refused, whatever is wrong, and only whole frames are there", "[merge][random]")
{
    const auto first = static_cast<std::uint64_t>(amount("WRONG_MERGES_SEED", 0));
    for (std::uint64_t k = 0; k < static_cast<std::uint64_t>(amount("WRONG_MERGES", 20)); ++k) {
        WrongParts wrong(first + k);
        const std::string damage = wrong.damage();
        CAPTURE(first + k, damage);
        const Result<MergedFiles> merged = wrong.merge();
        REQUIRE_FALSE(merged);
        CHECK((merged.error().kind == SceneError::WrongCall || merged.error().kind == SceneError::FailedFrame));
        CHECK_FALSE(merged.error().text().empty());
        CHECK(wrong.is_right_so_far());
    }
}

}  // namespace rapid

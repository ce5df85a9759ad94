// Records and files of an archive survive interference with the folder and the process.
#include "runtime/files/frame_archive.h"

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;

namespace {

namespace fs = std::filesystem;

const std::vector<std::string> words = {"one", "", "a record of some length", std::string(3, '\0'), "last"};

// Returns the end of each word in the journal, which has 8 bytes of magic and 16 bytes before each word.
std::vector<std::size_t> ends_of_words()
{
    std::vector<std::size_t> ends;
    std::size_t at = 8;
    for (const std::string& word : words) ends.push_back(at += 16 + word.size());
    return ends;
}

std::string journal_of_words(const fs::path& folder)
{
    FrameArchive archive(folder);
    archive.begin_journal({words[0], words[1]});
    for (std::size_t k = 2; k < words.size(); ++k) archive.add(words[k]);
    return test::file_text(archive.journal());
}

}  // namespace

TEST_CASE("a journal that ends anywhere has the records that end before", "[archive]")
{
    const test::TemporaryFolder folder;
    const std::string whole = journal_of_words(folder.path());
    const std::vector<std::size_t> ends = ends_of_words();
    REQUIRE(whole.size() == ends.back());
    for (std::size_t size = 8; size <= whole.size(); ++size) {
        folder.write("journal", whole.substr(0, size));
        const FrameArchive::Records records = *FrameArchive(folder.path()).read_journal();
        const auto count = std::upper_bound(ends.begin(), ends.end(), size) - ends.begin();
        CAPTURE(size);
        CHECK(records.whole == std::vector<std::string>(words.begin(), words.begin() + count));
        const bool is_torn = size > 8 && std::find(ends.begin(), ends.end(), size) == ends.end();
        CHECK(records.damaged == (is_torn ? 1 : 0));
    }
    fs::remove(folder / "journal");
    CHECK_FALSE(FrameArchive(folder.path()).read_journal());
}

TEST_CASE("no record of a damaged journal is another than was written", "[archive]")
{
    const test::TemporaryFolder folder;
    const std::string whole = journal_of_words(folder.path());
    for (std::size_t at = 0; at < whole.size(); ++at) {
        std::string damaged = whole;
        damaged[at] = static_cast<char>(damaged[at] ^ 4);
        folder.write("journal", damaged);
        const FrameArchive::Records records = *FrameArchive(folder.path()).read_journal();
        CAPTURE(at);
        CHECK(records.damaged > 0);
        CHECK(records.whole.size() < words.size());
        for (const std::string& record : records.whole)
            CHECK(std::find(words.begin(), words.end(), record) != words.end());
    }
}

TEST_CASE("a record that can't be written leaves those before and after it", "[archive]")
{
    const test::TemporaryFolder folder;
    FrameArchive archive(folder.path());
    archive.begin_journal({words[0]});
    rlimit before = {};
    ::getrlimit(RLIMIT_FSIZE, &before);
    const auto ignored = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit full = {fs::file_size(archive.journal()) + 20, before.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &full);
    CHECK_THROWS_AS(archive.add(words[2]), Error);
    ::setrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, ignored);
    archive.add(words[4]);
    const FrameArchive::Records records = *archive.read_journal();
    CHECK(records.whole == std::vector<std::string>{words[0], words[4]});
    CHECK(records.damaged == 0);
}

TEST_CASE("a log continues after an earlier record, and keeps later records until then", "[archive]")
{
    const test::TemporaryFolder folder;
    {
        RecordLog log(folder / "log");
        for (const std::string& word : words) log.append(word);
    }
    RecordLog log(folder / "log");
    std::uint64_t place = 0;
    std::string record;
    REQUIRE(log.read(place, record));
    log.continue_at(place);
    const std::uint64_t second = place;
    log.append(words[1]);
    std::vector<std::string> read;
    for (place = 0; log.read(place, record);) read.push_back(record);
    CHECK(read == words);
    place = second + 1;
    CHECK_FALSE(log.read(place, record));
    fs::create_symlink("log", folder / "link");
    CHECK_THROWS_AS(RecordLog(folder / "link"), Error);
}

TEST_CASE("a log in memory has the records of the processes that share it", "[archive]")
{
    RecordLog log = RecordLog::in_memory();
    log.append("to be replaced");
    const pid_t child = ::fork();
    if (child == 0) {
        log.clear();
        for (const std::string& word : words) log.append(word);
        ::_exit(0);
    }
    ::waitpid(child, nullptr, 0);
    std::vector<std::string> read;
    std::string record;
    for (std::uint64_t place = 0; log.read(place, record);) read.push_back(record);
    CHECK(read == words);
}

TEST_CASE("an archive finds its files by kind and frame, and says which could not be written", "[archive]")
{
    const test::TemporaryFolder folder;
    for (const char* other : {"frame.abc.rapid", "frame.rapid", "frames.0001.rapid", "frame.0001.other"})
        folder.write(other, "");
    fs::create_directory(folder / "frame.0009.rapid");
    FrameArchive archive(folder.path());
    for (const std::int64_t frame : {-3, 0, 12345})
        archive.submit("frame", frame, [](const fs::path& path) { std::ofstream(path) << "x"; });
    fs::create_directory(archive.journal());
    archive.begin_journal({"x"});
    archive.add("y");
    archive.submit("snapshot", 7, [](const fs::path&) { throw Error("can't be written"); });
    archive.finish();
    std::vector<std::int64_t> found;
    for (const auto& [frame, file] : archive.files("frame")) {
        found.push_back(frame);
        CHECK(file == archive.file("frame", frame));
    }
    CHECK(found == std::vector<std::int64_t>{-3, 0, 12345});
    CHECK(
        archive.take_failures() ==
        std::vector<std::string>{
            archive.journal().string() +
                ": can't be written: it is not a regular file; the run continues, but its results are not stored",
            (folder / "snapshot.0007.rapid").string() + ": can't be written; the run continues without this snapshot"});
    CHECK(archive.take_failures().empty());
}

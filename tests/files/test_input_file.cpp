#include "runtime/files/input_file.h"

#include <sys/stat.h>

#include <cstdlib>

#include "tests/files/temporary_folder.h"
#include "tests/test.h"

using namespace rapid;
using namespace rapid::test;

TEST_CASE("a file is read whole, however large", "[files]")
{
    const std::size_t size = GENERATE(0, 1, 4096, 5 << 20, 9 << 20);
    const TemporaryFolder folder;
    std::string text(size, '\0');
    for (std::size_t i = 0; i < size; ++i) text[i] = static_cast<char>(i * 2654435761u >> 24);
    std::ofstream(folder / "a", std::ios::binary) << text;

    CHECK((InputFile(folder / "a").text() == text));
    CHECK(check_readable(folder / "a") == size);
}

TEST_CASE("a file that is truncated after it was read is as it was", "[files]")
{
    const TemporaryFolder folder;
    std::ofstream(folder / "a") << std::string(100000, 'x');
    const InputFile file(folder / "a");
    std::filesystem::resize_file(folder / "a", 0);
    CHECK((file.text() == std::string(100000, 'x')));
}

TEST_CASE("a file that gzip compressed is read as it was before", "[files]")
{
    const std::size_t size = GENERATE(0, 1, 100000, 9 << 20);
    const TemporaryFolder folder;
    std::string text(size, '\0');
    for (std::size_t i = 0; i < size; ++i) text[i] = static_cast<char>(i / 1000 * 2654435761u >> 24);
    folder.write("a", text.substr(0, size / 2));
    folder.write("b", text.substr(size / 2));
    // A file of two members, as `cat a.gz b.gz` makes it.
    const std::string make = "cd " + folder.path().string() + " && (gzip -c a; gzip -c b) >both.gz";
    REQUIRE(std::system(make.c_str()) == 0);
    CHECK((InputFile(folder / "both.gz").text() == text));

    const std::string whole = file_text(folder / "both.gz");
    CHECK((InputFile(folder.write("padded.gz", whole + std::string(1000, '\0'))).text() == text));
    const auto error = [&](const std::string& bytes) {
        return error_of([&] { InputFile(folder.write("c.gz", bytes)); });
    };
    CHECK(error(whole.substr(0, whole.size() - 1)) == "can't be read: its compressed data ends early");
    CHECK(error(whole.substr(0, whole.size() - 8) + std::string(8, 'x')) ==
          "can't be read: its compressed data is damaged");
    CHECK(error(whole + std::string(10, '\0') + "x") == "can't be read: its compressed data is damaged");
    CHECK(without_gz("x/a.bgeo.gz") == "x/a.bgeo");
    CHECK(without_gz("x.gz/a.bgeo") == "x.gz/a.bgeo");
}

TEST_CASE("a folder, a device and a pipe without a writer are refused as files", "[files]")
{
    const TemporaryFolder folder;
    REQUIRE(::mkfifo((folder / "pipe").c_str(), 0600) == 0);
    const auto error = [](const std::filesystem::path& path) { return error_of([&] { InputFile file(path); }); };
    CHECK(error(folder / "pipe") == "can't be read: it is not a regular file");
    CHECK(error("/dev/zero") == "can't be read: it is not a regular file");
    CHECK(error(folder.path()) == "can't be read: Is a directory");
    CHECK(error(folder / "none") == "can't be read: No such file or directory");
}

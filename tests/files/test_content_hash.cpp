// Hashes of contents are the same in memory and in files.
#include "runtime/files/content_hash.h"

#include "tests/files/temporary_folder.h"
#include "tests/test.h"

namespace rapid {

TEST_CASE("a file has the hash of its bytes", "[hash]")
{
    const test::TemporaryFolder folder;
    std::string bytes(3'000'001, 'x');  // spans several of the pieces in which it is read
    for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{1} << 20, bytes.size()})
        CHECK(file_hash(folder.write("file", bytes.substr(0, size))) == content_hash(bytes.substr(0, size)));
    bytes.back() = 'y';
    CHECK(file_hash(folder / "file") != content_hash(bytes));
}

TEST_CASE("the hash of a string is XXH3's, with 16 digits", "[hash]")
{
    CHECK(hash_text(content_hash("")) == "2d06800538d394c2");  // from the reference implementation
    CHECK(hash_text(7) == "0000000000000007");
}

TEST_CASE("a path that is not a file has no hash", "[hash]")
{
    const test::TemporaryFolder folder;
    CHECK_THROWS_AS(file_hash(folder / "nothing"), Error);
    CHECK_THROWS_AS(file_hash(folder.path()), Error);
}

}  // namespace rapid

#include "runtime/base/parallel.h"

#include <tbb/global_control.h>

#include <atomic>
#include <mutex>
#include <set>
#include <stdexcept>
#include <utility>

#include "tests/test.h"

namespace rapid {
namespace {

using Chunks = std::set<std::pair<std::size_t, std::size_t>>;

Chunks chunks_of(std::size_t n)
{
    Chunks chunks;
    std::mutex mutex;
    for_each_chunk(n, [&](std::size_t begin, std::size_t end) {
        const std::lock_guard lock(mutex);
        REQUIRE(chunks.emplace(begin, end).second);
    });
    return chunks;
}

}  // namespace

TEST_CASE("chunks cover every point once, and only the last is short", "[parallel]")
{
    CHECK(chunks_of(0).empty());
    CHECK(chunks_of(1) == Chunks{{0, 1}});
    CHECK(chunks_of(chunk_size) == Chunks{{0, chunk_size}});
    CHECK(chunks_of(2 * chunk_size + 5) ==
          Chunks{{0, chunk_size}, {chunk_size, 2 * chunk_size}, {2 * chunk_size, 2 * chunk_size + 5}});
}

TEST_CASE("chunks do not depend on the number of threads", "[parallel][threads]")
{
    const Chunks expected = chunks_of(50 * chunk_size + 1);
    const int threads = GENERATE(1, 2, 7);
    CAPTURE(threads);
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    CHECK(chunks_of(50 * chunk_size + 1) == expected);
}

TEST_CASE("an exception in a chunk ends the loop and reaches the caller", "[parallel][threads]")
{
    const std::size_t n = GENERATE(as<std::size_t>{}, 1, 10 * chunk_size);
    CHECK_THROWS_WITH(for_each_chunk(n, [](std::size_t, std::size_t) { throw std::runtime_error("from a chunk"); }),
                      "from a chunk");
}

}  // namespace rapid

// Parallel loops over points in chunks of fixed size, so that chunks do not depend on the number of threads.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>

#include <algorithm>
#include <cstddef>

#include "runtime/base/cancellation.h"

namespace rapid {

// Points per chunk: its columns (P, v in double, a few floats) fit into a 1 MiB second-level cache.
constexpr std::size_t chunk_size = 4096;

// Calls f(begin, end) for each chunk of [0, n), in parallel and in any order. Rethrows the first exception of f. Throws
// Error if the run is cancelled.
template <class F>
void for_each_chunk(std::size_t n, const F& f, std::size_t size = chunk_size)
{
    const std::size_t chunks = (n + size - 1) / size;
    if (chunks == 0) return;
    Cancellation::check_current();
    if (chunks == 1) return f(std::size_t{0}, n);
    const Cancellation* const cancellation = Cancellation::current();
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, chunks, 1),
        [&](const tbb::blocked_range<std::size_t>& range) {
            const Cancellation::Scope scope(cancellation);
            for (std::size_t c = range.begin(); c != range.end(); ++c) {
                Cancellation::check_current();
                f(c * size, std::min(n, (c + 1) * size));
            }
        },
        tbb::simple_partitioner());
}

}  // namespace rapid

// Generates text or bytes in parallel and appends them to a file in order.
#pragma once

#include <tbb/parallel_pipeline.h>

#include <algorithm>
#include <string>
#include <utility>

#include "runtime/base/parallel.h"
#include "runtime/files/output_file.h"

namespace rapid {

// Appends piece(begin, end), a std::string, for each chunk of [0, n).
template <class F>
void append_chunks(OutputFile& file, std::size_t n, const F& piece)
{
    constexpr std::size_t tokens = 16;  // pieces in memory
    std::size_t next = 0;
    tbb::parallel_pipeline(
        tokens,
        tbb::make_filter<void, std::size_t>(tbb::filter_mode::serial_in_order, [&](tbb::flow_control& control) {
            if (next >= n) control.stop();
            return std::exchange(next, next + chunk_size);
        }) & tbb::make_filter<std::size_t, std::string>(tbb::filter_mode::parallel, [&](std::size_t begin) {
            return piece(begin, std::min(begin + chunk_size, n));
        }) & tbb::make_filter<std::string, void>(tbb::filter_mode::serial_in_order, [&](const std::string& text) {
            file.append(text.data(), text.size());
        }));
}

}  // namespace rapid
